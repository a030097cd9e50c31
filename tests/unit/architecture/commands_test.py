# SPDX-License-Identifier: Apache-2.0
"""Help, manual page, docs/cli.md and completion have the same commands, in the same order.

Argument: the program corbot.
"""
import pathlib
import re
import subprocess
import sys
import unittest

TOP = pathlib.Path(__file__).resolve().parents[3]
CORBOT = sys.argv.pop(1)


def helped(*command):
    """Returns the help of a command."""
    words = [CORBOT, *command, "--help"]
    return subprocess.run(words, capture_output=True, text=True, check=True, timeout=20).stdout


def subcommands(text):
    """Returns the names below "Subcommands:" in a help."""
    return re.findall(r"^  ([a-z]+) ", text.split("Subcommands:\n")[1], re.MULTILINE)


def in_help(text, cell):
    """Returns all commands of the help `text`, with those of `corbot cell` by its help."""
    names = [["cell " + name for name in subcommands(cell)] if name == "cell" else [name]
             for name in subcommands(text)]
    return [name for part in names for name in part]


def names_in_tag(tag):
    """Returns the commands that the line below .TP names: `open, close` or `cell down|status CELL`."""
    text = " ".join(re.sub(r'\\f[A-Z]|"', "", tag).split()[1:])
    first = re.match(r"(cell )?([a-z]+(?:(?:\|| ?, )[a-z]+)*)", text)
    return [(first[1] or "") + name for name in re.split(r"\|| ?, ", first[2])]


def in_manual(text):
    """Returns {section: its commands} of the manual page. Two entries may have the same command."""
    part = text.split(".SH COMMANDS\n")[1].split(".SH ")[0]
    sections = {}
    for section in part.split(".SS ")[1:]:
        tags = re.findall(r"^\.TP\n(.*)", section, re.MULTILINE)
        names = [name for tag in tags for name in names_in_tag(tag)]
        sections[section.split("\n")[0]] = list(dict.fromkeys(names))
    return sections


def in_page(text):
    """Returns {group: its commands} of the table in docs/cli.md."""
    table = text.split("| For | Commands |\n|---|---|\n")[1].split("\n\n")[0]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()]
    return {group: re.findall(r"`([a-z ]+)`", commands) for group, commands in rows}


def completed():
    """Returns the commands that the completion offers, and below `cell` those of the cell."""
    script = (". packaging/completion/corbot; "
              "for words in 'corbot' 'corbot cell'; do COMP_WORDS=($words ''); "
              "COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _corbot; echo \"${COMPREPLY[@]}\"; done")
    result = subprocess.run(["bash", "-c", script], capture_output=True, text=True, cwd=TOP, check=True)
    lines = result.stdout.splitlines()
    return [[word for word in line.split() if not word.startswith("-")] for line in lines]


def tags_of(manual):
    """Returns the entries' first lines as a reader sees them."""
    commands = manual.split(".SH COMMANDS\n")[1].split(".SH ")[0]
    tags = re.findall(r"^\.TP\n\.B[IR]* (.*)", commands, re.MULTILINE)
    plain = [re.sub(r"\\f.", "", tag).replace("\\-", "-") for tag in tags]
    return ["".join(quoted or bare for quoted, bare in re.findall(r'"([^"]*)"|(\S+)', tag)) for tag in plain]


def joined(groups):
    return [name for names in groups.values() for name in names]


class Commands(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.help, cls.cell = helped(), helped("cell")
        cls.names = in_help(cls.help, cls.cell)
        cls.manual = (TOP / "packaging/man/corbot.1").read_text()
        cls.page = (TOP / "docs/cli.md").read_text()
        cls.maxDiff = None

    def test_the_help_has_the_commands_of_a_robot_and_of_a_cell(self):
        self.assertGreater(len(self.names), 50)
        self.assertEqual(self.names[:4], ["up", "down", "doctor", "status"])
        self.assertIn("cell check", self.names)

    def test_the_manual_page_has_the_commands_in_the_order_of_the_help(self):
        self.assertEqual(joined(in_manual(self.manual)), self.names)

    def test_the_page_has_the_groups_of_the_manual_page(self):
        self.assertEqual(list(in_page(self.page).items()), list(in_manual(self.manual).items()))

    def test_the_completion_offers_the_commands_in_the_order_of_the_help(self):
        robot, cell = completed()
        self.assertEqual(robot, subcommands(self.help))
        self.assertEqual(cell, subcommands(self.cell))

    def test_each_option_of_a_command_is_in_its_entry_of_the_manual_page(self):
        general = {"--help", "--robot", "--timeout", "--dry-run", "--profile", "--plot", "--version"}
        entries = {}
        commands = self.manual.split(".SH COMMANDS\n")[1].split(".SH ")[0]
        for entry in commands.split(".TP\n")[1:]:
            for name in names_in_tag(entry.split("\n")[0]):
                entries[name] = entries.get(name, "") + entry.replace("\\-", "-")
        for name in self.names:
            if name in ("help", "panel", "cell up"):  # `cell up` refers to `cell run`
                continue
            options = set(re.findall(r"^  (?:-[a-z],)?(--[a-z-]+)", helped(*name.split()), re.MULTILINE))
            if name.startswith("cell ") and name != "cell run":
                options -= {"--name", "--ports", "--state-dir"}  # the manual page says this once, for all
            missing = [option for option in options - general if option not in entries[name]]
            self.assertEqual(missing, [], name)

    def test_the_manual_page_has_the_usage_of_each_command_of_a_robot(self):
        usages = {}
        for tag in tags_of(self.manual):
            for usage in [tag] if "[" in tag else tag.split(", "):  # "pause, resume"
                usages[usage.split()[0]] = usage
        counted = 0
        for name in subcommands(self.help):
            usage = re.search(r"^Usage: corbot (.*) \[--robot R\] \[--timeout S\]$", helped(name), re.M)
            if usage is None:  # the help of a command with options of its own
                continue
            counted += 1
            self.assertEqual(usages[name], usage[1].replace(" [--dry-run [--profile P --plot FILE]]", ""))
        self.assertGreater(counted, 20)

    def test_no_help_has_a_notation_of_the_parser(self):
        notation = re.compile(r" in \[|\(\d+x\)| x \d|REQUIRED|Needs:|Excludes:| (?:INT|FLOAT|TEXT)\b"
                              r"|[A-Z]:\d|\{")
        self.assertRegex("--count INT:1 to 9", notation)
        for name in ["", *self.names]:
            if name != "panel":  # another program, which may not be built
                self.assertNotRegex(helped(*name.split()), notation, name)

    def test_both_watch_commands_count_alike(self):
        count = [re.search(r"--count .*\n.*", helped(*name.split()))[0] for name in ("watch", "cell watch")]
        self.assertEqual(count[0], count[1])
        self.assertIn("0: go on until Ctrl-C", count[0])

    def test_finds_a_planted_difference(self):
        swapped = self.manual.replace(".B ready\n", ".B clear\n", 1)
        self.assertNotEqual(swapped, self.manual)
        self.assertNotEqual(joined(in_manual(swapped)), self.names)
        entry = re.search(r"\.TP\n\.B hold\n.*?(?=\.TP)", self.manual, re.DOTALL)[0]
        self.assertEqual(joined(in_manual(self.manual.replace(entry, ""))),
                         [name for name in self.names if name != "hold"])
        moved = self.help.replace("  up  ", "  x  ").replace("  down  ", "  up  ")
        moved = moved.replace("  x  ", "  down  ")
        self.assertEqual(in_help(moved, self.cell)[:2], ["down", "up"])
        page = self.page.replace("`record`, `plot`", "`plot`, `record`")
        self.assertNotEqual(list(in_page(page).items()), list(in_manual(self.manual).items()))


unittest.main()
