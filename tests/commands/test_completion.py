"""Tab completion in bash."""

import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

from prbm.commands.command_line import main, parser
from prbm.commands.completion import script
from prbm.files.mechanism_file import shipped

pytestmark = pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")


def completed(line: str) -> list[str]:
    """Return the proposals of bash for the last word of a line, empty after a space."""
    words = [*shlex.split(line), *([""] if line.endswith(" ") else [])]
    array = " ".join(map(shlex.quote, words))
    program = (
        f"{script(parser())}\nCOMP_WORDS=({array}); COMP_CWORD={len(words) - 1}; _prbm\n"
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
        ("prbm completion ", ["--help", "bash"]),
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


def test_the_command_prints_the_script(capsys):
    assert main(["completion", "bash"]) == 0
    assert capsys.readouterr().out == script(parser())
