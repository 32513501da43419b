"""Limits of files, classes and functions, in Python and C."""

from textwrap import dedent

import sizes


def test_files_classes_and_functions_are_within_their_limits():
    found = sizes.measured()
    print(sizes.report(found))
    assert len(found.files) > 100
    assert len(found.functions) > 1000
    assert sizes.violations(found) == []


def test_code_for_moving_walls_is_within_its_limit():
    """Functions with a wall in their names are counted, except those that do not move walls."""
    found = list(sizes.wall_functions())
    assert sum(x.size for x in found) <= sizes.WALLS_MAX
    others = {x.name for x in sizes.measured().functions if x.place.split(":")[0].endswith(".c")}
    named = {name for name in others if "wall" in name} - {"check_walls", "add_contacts_and_walls"}
    assert named | set(sizes.WALL_FUNCTIONS) <= {x.name for x in found}


def test_length_of_c_code_excludes_comments_and_blank_lines(tmp_path):
    path = tmp_path / sizes.WALLS_FILE
    path.parent.mkdir(parents=True)
    path.write_text(
        "int x;\n/* A\n * comment. */\nint\nf(void) {\n\n    return 1; /* one */\n}\n",
        encoding="utf-8",
    )
    assert [(x.size, x.name) for x in sizes.wall_functions(tmp_path)] == [(4, "f")]


def test_length_of_a_python_body_excludes_signature_and_docstring():
    text = dedent('''\
        class Pair:
            def first(
                self,
            ):
                """Return the first.

                It has two lines.
                """
                x = 1

                return x

            async def second(self): ...
        ''')
    assert [(x.size, x.name) for x in sizes.python_classes(text, "x.py")] == [(2, "Pair")]
    found = {x.name: (x.size, x.place) for x in sizes.python_functions(text, "x.py")}
    assert found == {"first": (3, "x.py:2"), "second": (1, "x.py:13")}


def test_length_of_a_c_body_is_the_number_of_lines_between_its_braces():
    text = dedent("""\
        #define LOOP(n) for (int i = 0; i < n; i++) { \\
            }
        struct pair { int a, b; };
        static const int table[] = { 1, 2 };
        enum { ONE };
        int declared(int a);
        static double sum(const double *x, /* { */ int n)
        {
            const char *text = "}"; // }
            if (n) {
                return x[0];
            }
            return '}';
        }
        int short_one(void) { return 1; }
        """)
    found = {x.name: (x.size, x.place) for x in sizes.c_functions(text, "x.c")}
    assert found == {"sum": (5, "x.c:8"), "short_one": (0, "x.c:15")}
