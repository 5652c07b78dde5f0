"""What people read in a file: the text of a page; comments and messages of a program, each at its line."""

import re

RUST = re.compile(
    r"""(?P<comment>//[^\n]*|/\*.*?\*/)|(?P<string>b?c?r(#*)".*?"\3|b?c?"(?:\\.|[^"\\])*")|'(?:\\.[^']*|[^\\'])'""", re.S
)
# Comments, then strings of three quotes and of one; what a placeholder holds is code.
PYTHON = re.compile(
    r"""(?P<comment>\#[^\n]*)|(?P<string>(?P<three>\"{3}|'{3}).*?(?P=three)|"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*')""", re.S
)
# In messages and comments: placeholders, names in backticks, targets of links, options, keys of TOML and of JSON, fields.
CODE_IN_MESSAGES = re.compile(r"\{[^{}\n]*\}|`[^`\n]*`|\]\([^)\n]*\)|--[a-z][a-z-]*|\bdoubt = |\*\.\w+|\b\w+\.\w+")


def blank(text):
    return "\n" * text.count("\n")


def without_code(text):
    """A page without blocks of code, code, targets of links and comments."""
    for code in (r"^```.*?^```", r"^    .*?$", r"<!--.*?-->", r"`[^`]*`", r"\]\([^)]*\)"):
        text = re.sub(code, lambda found: blank(found[0]), text, flags=re.S | re.M)
    return text


def comments_and_messages(text, language):
    """Nothing of the code, but lines are where they were. A string without a blank is a key, not a message."""
    parts, end = [], 0
    for found in language.finditer(text):
        parts.append(blank(text[end : found.start()]))
        end = found.end()
        read = found["comment"] or (found["string"] and re.search(r"\s", found["string"]))
        parts.append(CODE_IN_MESSAGES.sub("", found[0]) + " " if read else blank(found[0]))
    return "".join(parts)


def read_by_people(path, text):
    if path.suffix == ".md":
        return without_code(text)
    return comments_and_messages(text, RUST if path.suffix == ".rs" else PYTHON)
