"""The one reader of YAML."""

import pytest

from pose_core.errors import InputError
from pose_core.plain_yaml import MAX_BYTES, YamlError, dump_yaml, parse_yaml, read_yaml

BOMB = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{b}: &{b} [*{a}, *{a}, *{a}, *{a}, *{a}, *{a}, *{a}, *{a}, *{a}]\n"
    for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (BOMB, r"line 2: an alias \(\*name\) is not allowed"),
        ("[" * 20_000, "more than 32 levels"),
        ("a: 1\nb: 2\na: 3\n", "line 3: 'a' occurs twice"),
        ("a: " + "x" * MAX_BYTES, "larger than 256 kB"),
        ("!!python/object/apply:os.system ['true']", "could not determine a constructor"),
        ("when: 2024-99-99", "cannot be read"),
        ("<<: {a: 1}", "constructor"),
        ("? [a]\n: b\n", "cannot be a key"),
        ("a: [", "line 1: "),
        ("a: \x07", "special characters"),
    ],
)
def test_unsupported_yaml_is_refused_in_one_line(text, said):
    with pytest.raises(YamlError, match=said) as error:
        parse_yaml(text, "file")
    assert str(error.value).startswith("file is not plain YAML: ")
    assert "\n" not in str(error.value)


def test_the_error_of_a_missing_file_says_what_it_should_contain(tmp_path):
    with pytest.raises(InputError, match=r"cannot read the map .*none: No such file"):
        read_yaml(tmp_path / "none", "the map")


def test_repeated_values_are_written_and_read_without_aliases():
    shared = [1.0, 2.0]

    assert parse_yaml(dump_yaml({"b": shared, "a": shared}), "it") == {"b": shared, "a": shared}
