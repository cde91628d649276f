"""Substitutions of launch files."""

from pathlib import Path

import pytest

from pose_core.errors import InputError
from pose_launch.substitutions import Scope, condition, resolve, split_command_line

SCOPE = Scope(
    variables={"rate": "30.0", "name": "rate", "spaced": "two words"},
)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("plain", "plain"),
        ("", ""),
        ("$(var rate)", "30.0"),
        ("a $(var rate) b", "a 30.0 b"),
        ("$(var $(var name))", "30.0"),
        ("$(command 'printf %s:%s $(var rate) b')", "30.0:b"),
        ("$(equals $(var rate) 30.0)", "true"),
        ("$(not-equals $(var rate) 30.0)", "false"),
        ("$(not $(equals a b))", "true"),
        ("costs \\$(var rate)", "costs $(var rate)"),
        ("5 $ each", "5 $ each"),
        ("'quoted'", "'quoted'"),
    ],
)
def test_a_text_is_resolved(text, expected):
    assert resolve(text, SCOPE) == expected


def test_a_package_is_found_in_its_prefix():
    share = resolve("$(find-pkg-share pose_launch)", SCOPE)
    prefix = resolve("$(find-pkg-prefix pose_launch)", SCOPE)

    assert share == f"{prefix}/share/pose_launch"
    assert (Path(share) / "package.xml").is_file()


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("$(eval 1 + 1)", r"\$\(eval …\) is not supported: there are var, find"),
        ("$(var missing)", r"\$\(var missing\): nothing of that name"),
        ("$(find-pkg-share no_such_package)", "found no package 'no_such_package'"),
        ("$(var)", "has 0 arguments, expected 1"),
        ("$(var rate", r"without its '\)'"),
        ("$(var 'rate)", "has an open '"),
        ("$(equals x '')", r"which ros2 launch reads as \[\]"),
        ("$()", "without a name"),
        ("$(command 'no_such_program_anywhere')", "cannot run"),
        ("$(command 'sh -c \"echo oops >&2; exit 3\"')", "exit code 3, it said: oops"),
    ],
)
def test_an_unresolved_substitution_is_reported(text, complaint):
    with pytest.raises(InputError, match=complaint):
        resolve(text, SCOPE)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", []),
        ("a b  c", ["a", "b", "c"]),
        ("--rate $(var rate)", ["--rate", "30.0"]),
        ("$(var spaced)", ["two words"]),
        ("--x=$(var spaced) y", ["--x=two words", "y"]),
        ("$(var rate) $(var name)", ["30.0", "rate"]),
        ("'one word' two", ["one word", "two"]),
        ("$(var rate)/a b", ["30.0/a", "b"]),
        ("echo '$(var spaced) more' x", ["echo", "two words more", "x"]),
        ('"a $(var rate)"b', ["a 30.0b"]),
    ],
)
def test_a_command_line_is_split_but_not_inside_substitutions(text, expected):
    assert split_command_line(text, SCOPE) == expected


@pytest.mark.parametrize(("text", "expected"), [("true", True), ("0", False), ("False ", False)])
def test_a_condition_reads_yaml_truth(text, expected):
    assert condition(text, SCOPE) is expected


def test_a_condition_that_is_no_truth_value_is_refused():
    with pytest.raises(InputError, match="expected true or false"):
        condition("$(var rate)", SCOPE)
