# SPDX-License-Identifier: Apache-2.0
"""scripts/words finds a planted breach of each kind, and takes what keeps the rules. Takes no arguments."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

TOP = pathlib.Path(__file__).resolve().parents[3]
LONG = " ".join(["word"] * 31)


class Words(unittest.TestCase):
    def found_in(self, name, text):
        """The breaches of a tree of one file, without the file's name."""
        with tempfile.TemporaryDirectory() as root:
            file = pathlib.Path(root) / name
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
            result = subprocess.run([sys.executable, TOP / "scripts/words", "--root", root, name],
                                    capture_output=True, text=True)
        self.assertEqual(result.stderr, "")
        self.assertEqual(result.returncode, 1 if result.stdout else 0)
        return [line.removeprefix(f"{name}:") for line in result.stdout.splitlines()]

    def test_the_tree_keeps_the_rules(self):
        result = subprocess.run([sys.executable, TOP / "scripts/words"], capture_output=True, text=True)
        self.assertEqual(result.stdout + result.stderr, "")

    def test_takes_plain_sentences(self):
        self.assertEqual(
            self.found_in("a.h", "/// Returns the joints, in rad. The caller owns them.\nint what;\n"), [])
        self.assertEqual(
            self.found_in("a.md", "# What is here\n\nA page.\n\n"
                          "    Of code nothing is read.\n\n| Of | a table |\n"), [])

    def test_finds_each_opener(self):
        for word in ("Of", "What", "Who", "Whoever", "Likewise", "Nobody"):
            for name, text in (("a.cpp", f"// {word} is here.\n"), ("a.h", f"int a;  ///< {word} is here\n"),
                               ("a.py", f"# A noun is first. {word} is not.\n"),
                               ("b.py", f'"""{word} is here."""\n'),
                               ("a.java", f"/** {word} is here.\n * Here is more. */\n"),
                               ("a.md", f"- {word} is here.\n")):
                self.assertIn(f"1: a sentence begins with '{word}'", "\n".join(self.found_in(name, text)),
                              name)

    def test_finds_a_long_sentence_over_several_lines(self):
        begin, end = LONG[:70], LONG[71:]
        self.assertIn("1: 31 words, at most 30", self.found_in("a.idl", f"// {begin}\n// {end}\n")[0])
        self.assertIn("1: 31 words, at most 30", self.found_in("a.md", f"{begin}\n{end}\n")[0])

    def test_finds_a_long_line_but_for_tables_and_addresses(self):
        self.assertEqual(self.found_in("a.cpp", "int a;" + " " * 105 + "\n"), ["1: 111 columns, at most 110"])
        self.assertEqual(self.found_in("a.py", "# see https://" + "a" * 105 + "\n"), [])
        self.assertEqual(self.found_in("a.md", "| " + "a " * 55 + "|\n"), [])

    def test_finds_each_listed_word_and_says_what_to_write(self):
        self.assertEqual(self.found_in("a.c", "// The task hears a command.\n"),
                         ["1: 'hears': write receives, reads: The task hears a command."])

    def test_reads_the_messages_of_the_programs_as_one_text_over_several_literals(self):
        call = 'throw Failure("{} is up. "\n              "Nobody has seen its file");\n'
        self.assertEqual(self.found_in("src/a.cpp", call),
                         ["1: a sentence begins with 'Nobody': Nobody has seen its file",
                          "1: 'Nobody': write no client, no process: Nobody has seen its file"])
        self.assertEqual(self.found_in("tests/a.cpp", call), [])
        self.assertEqual(self.found_in("src/a.cpp", 'const char* name = "nobody";\n'), [])


unittest.main()
