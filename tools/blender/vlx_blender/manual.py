"""What is printed instead of a run: help, version, the manual page, the completion for bash (tools/man_page.h, completion.h)."""

import argparse
import re
import shutil
import textwrap


def help_text(parser):
    width = min(shutil.get_terminal_size().columns, 110)
    parser.formatter_class = lambda prog: argparse.RawDescriptionHelpFormatter(prog, max_help_position=30, width=width)
    for action in parser._actions:
        if action.option_strings and action.default and action.nargs != 0:
            action.help += f" (default: {action.default})"
    parser.description = textwrap.fill(parser.description, width)
    return parser.format_help().rstrip()


def escaped(text):
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return re.sub(r"^(?=[.'])", r"\\&", text, flags=re.M)


def names(action):
    value = "" if action.nargs == 0 else action.metavar or "|".join(action.choices)
    return ",".join(action.option_strings), value


def manual_page(parser, version):
    described = " ".join(parser.description.split())
    sentence = described.split(". ")[0]
    lines = [f'.TH VLX\\-BLENDER 1 "" "{version}"', ".SH NAME", f"vlx\\-blender \\- {escaped(sentence)}", ".SH SYNOPSIS",
             "\\fBvlx\\-blender\\fR \\fISCENE.blend\\fR \\fB\\-o\\fR \\fIOUTPUT\\fR [\\fIOPTIONS\\fR] [\\-\\- \\fIOPTIONS OF VLX\\-KRIGE\\fR]",
             ".SH DESCRIPTION", escaped(described), ".SH OPTIONS"]
    for action in parser._actions:
        option, value = names(action)
        default = f" (default: {action.default})" if option and action.default and action.nargs != 0 else ""
        lines += [".TP", f"\\fB{escaped(option or value)}\\fR" + (f" \\fI{escaped(value)}\\fR" if option and value else ""),
                  escaped(action.help + default)]
    return "\n".join([*lines, ".SH NOTES", ".nf", escaped(parser.epilog), ".fi"])


def completion(parser):
    options = " ".join(name for action in parser._actions for name in action.option_strings)
    cases = ""
    for action in parser._actions:
        if action.option_strings and action.nargs != 0:
            words = f"COMPREPLY=($(compgen -W '{' '.join(action.choices)}' -- \"$current\")); " if action.choices else ""
            cases += f"        {'|'.join(action.option_strings)}) {words}return ;;\n"
    return f"""_vlx_blender() {{
    local current="${{COMP_WORDS[COMP_CWORD]}}"
    COMPREPLY=()
    case "${{COMP_WORDS[COMP_CWORD - 1]}}" in
{cases}    esac
    if [[ $current == -* ]]; then
        COMPREPLY=($(compgen -W '{options}' -- "$current"))
    fi
}}
complete -o default -F _vlx_blender vlx-blender"""


def printed(parser, arguments, version):
    """Of --help and the like, else nothing. `version()` asks the programs for theirs."""
    for argument in arguments:
        if argument in ("-h", "--help"):
            return help_text(parser)
        if argument == "--version":
            return version()
        if argument == "--help-man":
            return manual_page(parser, version())
        if argument == "--completion":
            return completion(parser)
    return ""
