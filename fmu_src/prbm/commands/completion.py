"""``prbm completion``: a script for tab completion in bash, zsh or fish."""

import argparse
import re
from collections.abc import Iterator

from ..files.mechanism_file import shipped
from .command_line import parser

SCRIPT = """\
_prbm() {{
    local word="${{COMP_WORDS[COMP_CWORD]}}" previous="${{COMP_WORDS[COMP_CWORD-1]}}"
    local command="${{COMP_WORDS[1]}}" words="" files=""
    if [ "$COMP_CWORD" -gt 2 ] && [ "$command" = measure ]; then
        command="measure ${{COMP_WORDS[2]}}"
    fi
    case "$COMP_CWORD $command" in
        1\\ *) words="{commands}" ;;
{options}
    esac
    case "$command $previous" in
{choices}
    esac
    COMPREPLY=($(compgen -W "$words" -- "$word"))
    if [ -n "$files" ]; then
        local file
        while IFS= read -r file; do  # A line is a name, which may contain blanks.
            COMPREPLY+=("$file")
            compopt -o filenames 2> /dev/null
        done < <(compgen -f -X "$files" -- "$word"; compgen -d -- "$word")
    fi
}}
_prbm_build() {{
    COMP_WORDS=(prbm build "${{COMP_WORDS[@]:1}}")
    COMP_CWORD=$((COMP_CWORD + 1))
    _prbm
}}
complete -o default -F _prbm prbm
complete -o default -F _prbm_build prbm-build-fmu
"""
ZSH = """\
autoload -U +X compinit && compinit
autoload -U +X bashcompinit && bashcompinit
"""  # Zsh then reads the script of bash.
FISH = """\
complete -c prbm -f
complete -c prbm-build-fmu -w 'prbm build'
"""
MECHANISM = ("mechanism", "mechanisms", "files")  # Positional arguments that may be a mechanism.


def print_completion(options: argparse.Namespace) -> None:
    """Print the script."""
    scripts = {"bash": script, "zsh": lambda program: ZSH + script(program), "fish": fish_script}
    print(scripts[options.shell](parser()), end="")


def script(program: argparse.ArgumentParser) -> str:
    """Return the script of bash that completes the words of a command line.

    It completes commands, options, choices of options, shipped mechanisms and mechanism files.
    """
    options, choices = [], []
    for name, command in _commands(program):
        files = " files='!*.toml'" if _takes_mechanism(command) else ""
        options.append(
            f'        *\\ {_escaped(name)}) words="{" ".join(_words(command))}"{files} ;;'
        )
        for action in command._actions:
            if action.choices and action.option_strings:
                pattern = "|".join(f"{_escaped(name)}\\ {text}" for text in action.option_strings)
                words = " ".join(map(str, action.choices))
                choices.append(f'        {pattern}) words="{words}" files="" ;;')
    return SCRIPT.format(
        commands=" ".join(_words(program)), options="\n".join(options), choices="\n".join(choices)
    )


def fish_script(program: argparse.ArgumentParser) -> str:
    """Return the script of fish, which also shows the meaning of commands and options."""
    lines = [FISH]
    for name, command in ("", program), *_commands(program):
        words = name.split()
        seen = "; and ".join(f"__fish_seen_subcommand_from {word}" for word in words)
        subcommands = [a for a in command._actions if isinstance(a, argparse._SubParsersAction)]
        where = f'complete -c prbm -n "{seen or "__fish_use_subcommand"}"'
        for group in subcommands:
            missing = f"not __fish_seen_subcommand_from {' '.join(group.choices)}"
            first = f"{seen}; and {missing}" if seen else "__fish_use_subcommand"
            for choice in group._choices_actions:
                lines.append(f'complete -c prbm -n "{first}" -a {choice.dest} -d {_fish(choice)}\n')
        if _takes_mechanism(command):
            names = " ".join(shipped())
            lines.append(f"{where} -a '{names} (__fish_complete_suffix .toml)'\n")
        for action in command._actions:
            lines += [f"{where} {text}\n" for text in _fish_option(action)]
    return "".join(lines)


def _fish_option(action: argparse.Action) -> Iterator[str]:
    """Yield the arguments of ``complete`` for an option, or for a choice of words."""
    values = "" if isinstance(action.choices, dict) else " ".join(map(str, action.choices or ()))
    names = [text for text in action.option_strings if text.startswith("--")]
    if names and action.help != argparse.SUPPRESS:
        argument = f" -x -a '{values}'" if values else "" if action.nargs == 0 else " -r -F"
        yield f"-l {names[0][2:]}{argument} -d {_fish(action)}"
    elif values and not action.option_strings:
        yield f"-a '{values}'"


def _fish(action: argparse.Action) -> str:
    """Return the first phrase of a help text as a word of fish."""
    text = re.split(r"[;:(,]", action.help or "")[0].replace("%%", "%").strip()
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"


def _escaped(name: str) -> str:
    return name.replace(" ", "\\ ")


def _commands(
    program: argparse.ArgumentParser, prefix: str = ""
) -> Iterator[tuple[str, argparse.ArgumentParser]]:
    """Yield all commands and their subcommands by name."""
    for action in program._actions:
        for name, command in (action.choices if isinstance(action.choices, dict) else {}).items():
            yield f"{prefix}{name}", command
            yield from _commands(command, f"{prefix}{name} ")


def _takes_mechanism(command: argparse.ArgumentParser) -> bool:
    return any(a.dest in MECHANISM and not a.option_strings for a in command._actions)


def _words(command: argparse.ArgumentParser) -> list[str]:
    """Return the words that may follow a command."""
    words = []
    for action in command._actions:
        if action.help != argparse.SUPPRESS:
            words += [text for text in action.option_strings if text.startswith("--")]
        if not action.option_strings and action.choices:
            words += map(str, action.choices)
    return [*words, *(shipped() if _takes_mechanism(command) else ())]
