"""Tab completion in bash, zsh and fish."""

import os
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

from prbm.commands.command_line import main, parser
from prbm.commands.completion import ZSH, fish_script, script
from prbm.files.mechanism_file import shipped

FUNCTIONS = {"prbm": "_prbm", "prbm-build-fmu": "_prbm_build"}


def needs_shell(name: str) -> None:
    """Skip the test if a shell is missing."""
    if shutil.which(name) is None:
        pytest.skip(f"needs {name}")


def completed(line: str) -> list[str]:
    """Return the proposals of bash for the last word of a line, empty after a space."""
    needs_shell("bash")
    words = [*shlex.split(line), *([""] if line.endswith(" ") else [])]
    array = " ".join(map(shlex.quote, words))
    program = (
        f"{script(parser())}\nCOMP_WORDS=({array}); COMP_CWORD={len(words) - 1}\n"
        f"{FUNCTIONS[words[0]]}\n"
        'printf "%s\\n" "${COMPREPLY[@]}"'
    )
    done = subprocess.run(["bash", "-c", program], capture_output=True, text=True, check=True)
    assert done.stderr == ""
    return done.stdout.splitlines()


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("prbm simu", ["simulate"]),
        ("prbm mo", ["modes", "modelica"]),
        ("prbm measure yo", ["youngs-modulus"]),
        ("prbm measure youngs-modulus --le", ["--length"]),
        ("prbm simulate --sto", ["--stop-time"]),
        ("prbm simulate PRBDM --inp", ["--input"]),
        ("prbm simulate Bi", ["Bistable"]),
        ("prbm simulate PRBDM --spectrum ", ["first", "last"]),
        ("prbm impact-map PRBDM --method al", ["algebraic"]),
        ("prbm impact-map --h", ["--help"]),
        ("prbm completion ", ["--help", "bash", "zsh", "fish"]),
        ("prbm build --flav", ["--flavour"]),
        ("prbm-build-fmu --flav", ["--flavour"]),
        ("prbm-build-fmu --flavour ", ["python", "native"]),
        ("prbm-build-fmu Bi", ["Bistable"]),
        ("prbm study PRBDM --mi", ["--minimise"]),
        ("prbm nonsense --s", [""]),
    ],
)
def test_words_are_completed(line, words):
    assert completed(line) == words


def test_mechanism_files_of_the_folder_are_proposed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("mine.toml").write_text("", encoding="utf-8")
    Path("mine.csv").write_text("", encoding="utf-8")
    assert completed("prbm modes mi") == ["mine.toml"]
    names = [word for word in completed("prbm modes ") if not word.startswith("--")]
    assert names == [*shipped(), "mine.toml"]


def test_names_with_blanks_stay_whole_and_folders_are_proposed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("my guide.toml").write_text("", encoding="utf-8")
    Path("my parts").mkdir()
    Path("my parts", "inner.toml").write_text("", encoding="utf-8")
    assert completed("prbm modes my") == ["my guide.toml", "my parts"]
    assert completed("prbm modes 'my parts/'") == ["my parts/inner.toml"]


def test_the_shell_escapes_blanks_of_file_names_alone(tmp_path, monkeypatch):
    """The option ``filenames`` of bash is on if a file is proposed, and off for words."""
    monkeypatch.chdir(tmp_path)
    Path("my guide.toml").write_text("", encoding="utf-8")
    for word, options in (("my", "-o filenames"), ("PRBDM2R", "")):
        program = (
            f'{script(parser())}\ncompopt() {{ echo "$*"; }}\n'
            f"COMP_WORDS=(prbm modes {word}); COMP_CWORD=2; _prbm"
        )
        done = subprocess.run(["bash", "-c", program], capture_output=True, text=True, check=True)
        assert done.stdout.strip() == options


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("prbm simu", ["simulate"]),
        ("prbm measure yo", ["youngs-modulus"]),
        ("prbm measure youngs-modulus --le", ["--length"]),
        ("prbm modes mi", ["mine.toml"]),
        ("prbm simulate Bi", ["Bistable"]),
        ("prbm simulate PRBDM --spectrum ", ["first", "last"]),
        ("prbm new X --kind p", ["pivot"]),
        ("prbm-build-fmu --flavour ", ["native", "python"]),
    ],
)
def test_fish_completes_words_with_their_meaning(line, words, tmp_path, monkeypatch):
    needs_shell("fish")
    monkeypatch.chdir(tmp_path)
    Path("mine.toml").write_text("", encoding="utf-8")
    Path("complete.fish").write_text(fish_script(parser()), encoding="utf-8")
    program = f"source complete.fish; complete -C {shlex.quote(line)}"
    done = subprocess.run(
        ["fish", "--no-config", "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stderr == ""
    assert [text.partition("\t")[0] for text in done.stdout.splitlines()] == words


def test_zsh_reads_the_script_of_bash(tmp_path):
    needs_shell("zsh")
    path = tmp_path / "script"
    program = "COMP_WORDS=(prbm completion ''); COMP_CWORD=2; _prbm; print -l -- ${COMPREPLY[@]}"
    path.write_text(f"{ZSH}{script(parser())}setopt ksharrays\n{program}\n", encoding="utf-8")
    done = subprocess.run(
        ["zsh", "-f", path], capture_output=True, text=True, check=True,
        env=os.environ | {"ZDOTDIR": str(tmp_path)},
    )  # fmt: skip
    assert done.stderr == ""
    assert done.stdout.split()[0] == "--help"


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_command_prints_the_script(shell, capsys):
    assert main(["completion", shell]) == 0
    printed = capsys.readouterr().out
    assert printed == {
        "bash": script(parser()), "zsh": ZSH + script(parser()), "fish": fish_script(parser())
    }[shell]  # fmt: skip
