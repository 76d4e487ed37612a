#!/usr/bin/env python3
"""check_layers.py must accept a good tree and find every kind of mistake in a bad one."""

import pathlib
import subprocess
import sys
import tempfile
import unittest

import check_layers

GOOD = {
    "core/a.h": "#pragma once\n#include <vector>\n#include <tl/expected.hpp>\n",
    "core/a.cpp": '#include "core/a.h"\n',
    "config/c.h": '#pragma once\n#include "core/a.h"\n',
    "drivers/d.h": '#pragma once\n#include "config/c.h"\n',
    "slam/s.h": '#pragma once\n#include "core/a.h"\n#include "config/c.h"\n',
    "daemon/app.cpp": '#include <posed/pose_t.hpp>\n#include "drivers/d.h"\n#include "slam/s.h"\n',
    "daemon/app.h": "#pragma once\n",
    "tools/posectl.cpp": '#include <posed/pose_t.hpp>\n#include "daemon/app.h"\n',
    "tests/support/helper.h": '#pragma once\n#include "daemon/app.h"\n',
    "tests/unit/app_test.cpp": '#include <posed/pose_t.hpp>\n#include "tests/support/helper.h"\n#include "slam/s.h"\n',
    "README.md": "Configuration is looked for in ~/.config, $HOME/.config and /etc/posed/posed.toml; see https://example.org/home/page.\n",
}
MACHINE = "/" + "home" + "/somebody"


class CheckLayers(unittest.TestCase):
    def problems(self, changes=None):
        """Violations of the good tree with `changes` ({path: text}) made to it."""
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for name, text in {**GOOD, **(changes or {})}.items():
                path = root / name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text, encoding="utf-8")
            return check_layers.check(root)[0]

    def assert_found(self, name, line, part, text):
        problems = self.problems({name: text})
        self.assertEqual([(name, line)], [problem[:2] for problem in problems])
        self.assertIn(part, problems[0][2])

    def test_accepts_a_good_tree(self):
        self.assertEqual([], self.problems())

    def test_lower_layers_do_not_include_higher_ones(self):
        order = ["core/a.h", "config/c.h", "drivers/d.h", "daemon/app.h", "tools/t.h"]
        for low in range(len(order)):
            for high in range(low + 1, len(order)):
                with self.subTest(low=order[low], high=order[high]):
                    folder = order[low].split("/")[0]
                    changes = {"tools/t.h": "#pragma once\n", f"{folder}/bad.cpp": f'\n#include "{order[high]}"\n'}
                    self.assertEqual(
                        [(f"{folder}/bad.cpp", 2, f'{folder} must not include "{order[high]}"')], self.problems(changes))

    def test_siblings_do_not_include_each_other(self):
        siblings = {"drivers": "drivers/d.h", "slam": "slam/s.h", "detect": "detect/e.h"}
        for folder in siblings:
            for other, header in siblings.items():
                if other != folder:
                    with self.subTest(folder=folder, other=other):
                        changes = {"detect/e.h": "#pragma once\n", f"{folder}/bad.cpp": f'#  include "{header}"\n'}
                        self.assertEqual(1, len(self.problems(changes)))

    def test_only_map_files_the_daemon_and_what_is_above_it_know_messages(self):
        for folder in ["core", "config", "drivers", "detect"]:
            self.assert_found(f"{folder}/bad.cpp", 1, "generated message", "#include <posed/pose_t.hpp>\n")
        self.assertEqual([], self.problems({"slam/good.cpp": "#include <posed/map_header_t.hpp>\n"}))

    def test_only_tests_include_tests(self):
        for folder in ["core", "daemon", "tools"]:
            self.assert_found(f"{folder}/bad.cpp", 1, "must not include", '#include "tests/support/helper.h"\n')

    def test_includes_are_written_from_the_root(self):
        for target in ["a.h", "../core/a.h", "core/../core/a.h"]:
            self.assert_found("core/bad.cpp", 1, "from the root", f'#include "{target}"\n')
        self.assert_found("core/bad.cpp", 1, "is the project's own", "#include <core/a.h>\n")
        self.assert_found("core/bad.cpp", 1, "does not exist", '#include "core/missing.h"\n')

    def test_headers_use_pragma_once(self):
        self.assert_found("core/bad.h", 1, "#pragma once", "#ifndef CORE_BAD_H\n#define CORE_BAD_H\n#endif\n")

    def test_files_keep_their_sizes(self):
        self.assertEqual([], self.problems({"core/big.h": "#pragma once\n" * 150, "core/big.cpp": "\n" * 450}))
        self.assert_found("core/big.h", 151, "151 lines, 150 are allowed", "#pragma once\n" * 151)
        self.assert_found("core/big.cpp", 451, "451 lines, 450 are allowed", "\n" * 451)

    def test_an_exception_in_size_reaches_as_far_as_it_says(self):
        check_layers.LARGER_FILES["core/big.cpp"] = (460, "a table")
        try:
            self.assertEqual([], self.problems({"core/big.cpp": "\n" * 460}))
            self.assert_found("core/big.cpp", 461, "461 lines, 460 are allowed", "\n" * 461)
        finally:
            del check_layers.LARGER_FILES["core/big.cpp"]

    def test_no_file_names_a_folder_of_one_machine(self):
        for name in ["core/bad.cpp", "docs/bad.md", "config/bad.toml", "CMakeLists.txt", "tools/script-without-suffix"]:
            self.assert_found(name, 2, MACHINE, f'\n"{MACHINE}/data"\n')
        for name in ["build/dev/CMakeCache.txt", "compile_commands.json", ".git"]:
            self.assertEqual([], self.problems({name: f"{MACHINE}\n"}))

    def test_every_source_has_a_folder_with_rules(self):
        self.assert_found("extra/bad.cpp", 1, "belong in one of the folders", "")

    def test_the_command_names_file_and_line_and_fails(self):
        script = pathlib.Path(check_layers.__file__)
        with tempfile.TemporaryDirectory() as folder:
            empty = subprocess.run([sys.executable, script, folder], capture_output=True, text=True, check=False)
            self.assertNotEqual(0, empty.returncode)  # a wrong path must not look like a clean tree
            (pathlib.Path(folder) / "core").mkdir()
            (pathlib.Path(folder) / "core/bad.cpp").write_text('\n#include "slam/s.h"\n', encoding="utf-8")
            bad = subprocess.run([sys.executable, script, folder], capture_output=True, text=True, check=False)
            self.assertEqual(1, bad.returncode)
            self.assertIn('core/bad.cpp:2: core must not include "slam/s.h"', bad.stdout)
            (pathlib.Path(folder) / "core/bad.cpp").write_text("\n", encoding="utf-8")
            good = subprocess.run([sys.executable, script, folder], capture_output=True, text=True, check=False)
            self.assertEqual(0, good.returncode, good.stdout)


if __name__ == "__main__":
    unittest.main()
