"""The layer test must catch what it is there for: a clean tree passes, each kind of offence is named."""

import pathlib
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "tools"))
import check_layers  # noqa: E402


class Tree:
    """A small source tree that passes, for tests to spoil."""

    def __init__(self, folder):
        self.root = pathlib.Path(folder)
        for part in check_layers.ARROWS:
            self.write(f"relief/{part}/{part}.h", "#pragma once\n#include <vector>\n")
            self.write(f"relief/{part}/{part}.cpp", f"#include <relief/{part}/{part}.h>\n#include <sys/mman.h>\n")
            for below in check_layers.ARROWS[part]:
                self.append(f"relief/{part}/{part}.cpp", f"#include <relief/{below}/{below}.h>\n")
        self.publish(*(f"relief/{part}/{part}.h" for part in check_layers.ARROWS))

    def publish(self, *headers):
        file = self.root / check_layers.PUBLIC_LIST
        listed = file.read_text(encoding="utf-8").split() if file.exists() else []
        self.write(check_layers.PUBLIC_LIST, "\n".join(sorted([*listed, *headers])) + "\n")

    def write(self, path, text):
        (self.root / path).parent.mkdir(parents=True, exist_ok=True)
        (self.root / path).write_text(text, encoding="utf-8")

    def append(self, path, text):
        with open(self.root / path, "a", encoding="utf-8") as file:
            file.write(text)

    def offences(self):
        return check_layers.check(self.root)


class CheckLayers(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.tree = Tree(folder.name)

    def assert_one(self, *words):
        offences = self.tree.offences()
        self.assertEqual(len(offences), 1, offences)
        for word in words:
            self.assertIn(word, offences[0])

    def test_clean_tree_passes(self):
        self.assertEqual(self.tree.offences(), [])

    def test_every_missing_arrow_is_caught(self):
        parts = list(check_layers.ARROWS)
        checked = 0
        for source in parts:
            path = f"relief/{source}/{source}.cpp"
            whole = (self.tree.root / path).read_text(encoding="utf-8")
            for target in parts:
                if target in check_layers.closure(source):
                    continue
                self.tree.append(path, f"#include <relief/{target}/{target}.h>\n")
                self.assert_one(path, f"{source} may not depend on {target}")
                self.tree.write(path, whole)
                checked += 1
        self.assertGreater(checked, 60)

    def test_the_five_in_the_middle_never_meet(self):
        middle = {"convert", "edit", "haptics", "file", "render"}
        for part in middle:
            self.assertEqual(check_layers.closure(part) & middle, {part})

    def test_what_lies_below_may_be_included(self):
        self.tree.append("relief/session/session.cpp", "#include <relief/core/core.h>\n#include <relief/base/base.h>\n")
        self.assertEqual(self.tree.offences(), [])

    def test_arrow_written_otherwise_is_caught(self):
        for line in ('#include "../edit/edit.h"\n', "  #  include  <relief/edit/edit.h>\n", "/* a */ \n#include\t<relief/edit/edit.h>\n"):
            path = "relief/haptics/haptics.cpp"
            whole = (self.tree.root / path).read_text(encoding="utf-8")
            self.tree.append(path, line)
            self.assert_one("haptics may not depend on edit", "touch does not know sculpting")
            self.tree.write(path, whole)

    def test_comments_and_text_do_not_count(self):
        self.tree.append(
            "relief/core/core.cpp",
            "// #include <relief/mesh/mesh.h>\n/*\n#include <relief/mesh/mesh.h>\n*/\n"
            'const char* kText = R"(\n#include <relief/mesh/mesh.h>\n)";\n',
        )
        self.assertEqual(self.tree.offences(), [])

    def test_forbidden_link_is_caught(self):
        self.tree.write("relief/core/CMakeLists.txt", "relief_library(core SOURCES core.cpp PUBLIC relief::base relief::mesh)\n")
        self.assert_one("relief/core/CMakeLists.txt", "core may not depend on mesh")

    def test_circle_is_caught(self):
        self.tree.write("relief/core/a.h", "#include <relief/core/b.h>\n")
        self.tree.write("relief/core/b.h", "#include <relief/core/c.h>\n")
        self.tree.write("relief/core/c.h", '#include "a.h"\n')
        self.assert_one("circle", "a.h -> relief/core/b.h -> relief/core/c.h -> relief/core/a.h")

    def test_other_libraries_stay_out_of_public_headers(self):
        self.tree.publish("relief/render/pictures.h")
        for name in ("Eigen/Core", "epoxy/gl.h", "GL/gl.h", "sqlite3.h", "CLI/CLI.hpp", "windows.h", "sys/mman.h"):
            self.tree.write("relief/render/pictures.h", f"#include <{name}>\n")
            self.assert_one("relief/render/pictures.h:1", name)

    def test_other_libraries_stay_in_their_part(self):
        self.tree.append("relief/convert/convert.cpp", "#include <Eigen/Core>\n")
        self.tree.write("relief/convert/rays.h", "#include <embree3/rtcore.h>\n")
        self.assertEqual(self.tree.offences(), [])
        self.tree.append("relief/haptics/haptics.cpp", "#include <Eigen/Core>\n")
        self.assert_one("relief/haptics/haptics.cpp", "Eigen/Core belongs to convert")

    def test_unknown_library_is_named(self):
        self.tree.append("relief/edit/edit.cpp", "#include <boost/any.hpp>\n")
        self.assert_one("relief/edit/edit.cpp", "boost/any.hpp")

    def test_internal_headers_stay_inside(self):
        self.tree.write("relief/verify/tree.h", "#pragma once\n")
        self.tree.write("relief/verify/detail/exact.h", "#pragma once\n")
        self.tree.append("relief/verify/verify.cpp", "#include <relief/verify/tree.h>\n#include <relief/verify/detail/exact.h>\n")
        self.tree.write("tests/unit/verify/tree_test.cpp", "#include <relief/verify/tree.h>\n")
        self.assertEqual(self.tree.offences(), [])
        for path in ("relief/convert/convert.cpp", "apps/relief/main.cpp", "tests/unit/convert/a_test.cpp", "examples/hello.cpp"):
            whole = (self.tree.root / path).read_text(encoding="utf-8") if (self.tree.root / path).exists() else ""
            self.tree.write(path, whole + "#include <relief/verify/tree.h>\n")
            self.assert_one(path, "internal to verify")
            self.tree.write(path, whole)

    def test_public_headers_include_public_headers(self):
        self.tree.write("relief/verify/tree.h", "#pragma once\n")
        self.tree.append("relief/verify/verify.h", "#include <relief/verify/tree.h>\n")
        self.assert_one("relief/verify/verify.h", "not public")

    def test_try_macros_stay_in_sources(self):
        self.tree.write("relief/base/try.h", "#pragma once\n")
        self.tree.append("relief/core/core.cpp", "#include <relief/base/try.h>\n")
        self.assertEqual(self.tree.offences(), [])
        self.tree.append("relief/core/core.h", "#include <relief/base/try.h>\n")
        self.assert_one("relief/core/core.h", "try.h")

    def test_list_of_public_headers_is_checked(self):
        self.tree.publish("relief/core/gone.h")
        self.assert_one("there is no relief/core/gone.h")
        self.tree.write(check_layers.PUBLIC_LIST, "relief/core/core.h\nrelief/base/base.h\n")
        self.assertTrue(any("not in order" in line for line in self.tree.offences()))

    def test_missing_header_and_unknown_part_are_named(self):
        self.tree.append("relief/core/core.cpp", "#include <relief/core/gone.h>\n")
        self.assert_one("there is no relief/core/gone.h")
        self.tree.write("relief/core/core.cpp", "")
        self.tree.write("relief/utils/all.h", "#pragma once\n")
        self.assert_one("relief/utils/all.h")


if __name__ == "__main__":
    unittest.main()
