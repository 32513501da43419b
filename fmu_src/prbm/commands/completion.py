"""``prbm completion``: a script for tab completion in bash."""

import argparse
from collections.abc import Iterator

from ..files.mechanism_file import shipped
from .command_line import parser

SCRIPT = """\
# Tab completion of prbm in bash: eval "$(prbm completion bash)"
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
complete -o default -F _prbm prbm
"""
MECHANISM = ("mechanism", "files")  # Positional arguments that may be a mechanism.


def print_completion(options: argparse.Namespace) -> None:
    """Print the script."""
    print(script(parser()), end="")


def script(program: argparse.ArgumentParser) -> str:
    """Return the script that completes the words of a command line.

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
