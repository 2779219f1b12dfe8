"""One reader of YAML: which numbers there are, merges, keys that stand twice, and texts that would eat the machine."""

from __future__ import annotations

import os
import re
import time
import tracemalloc

import pytest
import yaml

import dms_core.files.yaml_builder as builder
from dms_core.errors import InputError
from dms_core.files.yaml_builder import MOST_VALUES
from dms_core.files.yaml_text import MOST_PORTABLE, parse_yaml, read_value, read_yaml, yaml_of

MOST_SECONDS, MOST_MEGABYTES = 2.0, 100


@pytest.fixture(params=["fast", "python"], autouse=True)
def parser(request, monkeypatch):
    """Both parsers, since PyYAML may be built without libyaml."""
    if request.param == "python":
        monkeypatch.setattr(builder, "FAST", yaml.SafeLoader)
    parse_yaml.__globals__["_kept"].cache_clear()
    return request.param


def value(text, **how):
    return parse_yaml(f"a: {text}\n", "f.yaml", **how)["a"]


def said(text, **how):
    with pytest.raises(InputError) as caught:
        parse_yaml(text, "f.yaml", **how)
    sentence = str(caught.value)
    assert sentence.startswith("file 'f.yaml'") and len(sentence) < 400 and sentence.isprintable()
    return sentence


@pytest.mark.parametrize(
    ("text", "right"),
    [
        ("010", 10), ("0o10", 8), ("0x1F", 31), ("+1", 1), ("-0", 0), ("09", 9), ("1:30", "1:30"), ("1_000", "1_000"),
        ("0b1", "0b1"), ("1e5", 1e5), ("1E-5", 1e-5), (".5", 0.5), ("5.", 5.0), ("+.5", 0.5), ("-.5e1", -5.0),
        (".inf", float("inf")), ("-.INF", float("-inf")), ("true", True), ("FALSE", False),
        ("yes", "yes"), ("on", "on"),
        ("2020-01-01", "2020-01-01"), ("", None), ("~", None), ("null", None), ("NULL", None), ("=", "="), ("<<", "<<"),
        ("'1.8'", "1.8"), ('"true"', "true"), ("! 12", "12"), ("!!str 12", "12"), ("!!float 3", 3.0), ("!!int '3'", 3),
        (".", "."), ("e5", "e5"), ("1e", "1e"), ("0x", "0x"), ("lin_3e-4", "lin_3e-4"),
    ],
)  # fmt: skip
def test_scalars_are_those_of_yaml_1_2(text, right):
    found = value(text)
    assert found == right and type(found) is type(right)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("010", "010 is the number 8 in YAML 1.1, by which rl_zoo3 reads this file, and the number 10 in YAML 1.2. "
                "Write 8 or 10."),
        ("1:30", "is the number 90 in YAML 1.1.*and text in YAML 1.2. Write 90 or '1:30' in quotes"),
        ("1_000", "the number 1000 in YAML 1.1.*Write 1000 or '1_000' in quotes"),
        ("1e5", "1e5 is text in YAML 1.1.*the number 100000.0 in YAML 1.2. Write 100000.0 or '1e5' in quotes"),
        ("1.0e5", "text in YAML 1.1"),
        ("0o10", "Write 8 or '0o10' in quotes"),
        ("yes", "yes is true in YAML 1.1.*Write true or 'yes' in quotes"),
        ("off", "off is false in YAML 1.1"),
        ("2020-01-01", "a date in YAML 1.1.*Write '2020-01-01' in quotes"),
        ("2020-13-45", "an error in YAML 1.1"),
        ("=", "Write '=' in quotes"),
        ("<<", "Write '<<' in quotes"),
        ("09", "Write 9 or '09' in quotes"),
        ("+.5", "Write 0.5 or"),
        ("! 12", "the number 12 in YAML 1.1"),
        ("!!int 010", "the number 8 in YAML 1.1"),
    ],
)  # fmt: skip
def test_what_the_versions_read_differently_is_refused_in_portable_files(text, words):
    with pytest.raises(InputError, match=f"'f.yaml', line 1, column 4: .*{words}"):
        value(text, portable=True)


@pytest.mark.parametrize(
    "text", ["!!float 1e6", "lin_3e-4", "5.0e+6", "0.5", "10", "'1e5'", "true", "null", "", "0x1F", ".inf", "1.0e-05"]
)
def test_what_both_read_alike_is_portable(text):
    assert value(text, portable=True) == yaml.safe_load(f"a: {text}")["a"] == value(text)


def test_keys_are_portable_too():
    with pytest.raises(InputError, match="line 1, column 1: on is true in YAML 1.1"):
        parse_yaml("on: 1\n", "f.yaml", portable=True)
    assert parse_yaml("on: 1\n", "f.yaml") == {"on": 1}


def test_a_merge_gives_what_is_not_given():
    found = parse_yaml(
        "rod: &rod {kind: rigid_body, name: rod, mass: 1}\n"
        "light: &light {mass: 0.1, colour: red}\n"
        "a: {<<: *rod, name: rod2}\n"
        "b: {name: rod3, <<: *rod}\n"
        "c:\n  <<: [*light, *rod]\n  name: rod4\n"
        "d: {'<<': 3}\n",
        "f.yaml",
    )
    assert found["a"] == {"kind": "rigid_body", "name": "rod2", "mass": 1}
    assert found["b"] == {"kind": "rigid_body", "name": "rod3", "mass": 1}
    assert found["c"] == {"kind": "rigid_body", "name": "rod4", "mass": 0.1, "colour": "red"}
    assert found["d"] == {"<<": 3}
    assert [found[k].line for k in "abcd"] == [3, 4, 6, 8]
    found["a"]["mass"] = 2
    assert found["rod"]["mass"] == 1


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a: 1\na: 2\n", "line 2, column 1: the key 'a' stands twice."),
        ("a: {b: 1, 'b': 2}", "the key 'b' stands twice"),
        ("&x a: 1\n*x : 2", "the key 'a' stands twice"),
        ("r: &r {a: 1}\nq: {<<: *r, <<: *r}", "the merge key << stands twice"),
        ("a: {<<: 3}", "<<: 3: expected a mapping or a list of mappings"),
        ("a: {<<: [1]}", r"<<: \[1\]: expected a mapping"),
        ("1: 2", "the key 1 is not text"),
        (".nan: 2", "the key nan is not text"),
        ("~: 2", "the key None is not text"),
        ("? [a]\n: 1", "a list stands where a key is expected"),
        ("? {a: b}\n: 1", "a mapping stands where a key is expected"),
        ("a: *b", r"the alias \*b has no anchor"),
        ("a: &b [*b]", r"the alias \*b stands within its own anchor"),
        ("&b a: {<<: *c}", r"the alias \*c has no anchor"),
        ("a: 1\n---\nb: 2", "line 2, column 1: a second document begins"),
        ("%YAML 1.1\n---\na: 010", "'%YAML 1.1' asks for another version"),
        ("a: !!binary eA==", "the tag '!!binary' is not read here; expected none, or !!null"),
        ("a: !!set {a, b}", "the tag '!!set' is not read here"),
        ("a: !!omap [a: 1]", "the tag '!!omap' is not read here"),
        ("a: !!timestamp 2020-01-01", "the tag '!!timestamp'"),
        ("a: !!python/object/apply:os.getcwd []", "the tag '!!python/object/apply:os.getcwd'"),
        ("a: !mine 3", "the tag '!mine'"),
        ("a: !!int yes", "'yes' is not taken: it is no int"),
        ("a: \x07", r"line 1, column 4: the character '\\x07' is not allowed"),
        ("a: 1\nb: \"\\0\"", r"line 2, column 4: the character '\\x00' is not allowed"),
        ('"a\\nb": 1', r"the key 'a\\nb' holds characters that are not printed"),
        ("a:\n\t- b", "line 2, column 1 is not valid YAML: a tab"),
        ("a: @b", "no value begins with '@'; put it in quotes"),
        ("a: [1", "is not valid YAML"),
        ("[1]", "holds a list. Expected a mapping"),
        ("# nothing", "holds nothing. Expected a mapping"),
    ],
)  # fmt: skip
def test_mistakes_are_shown_with_their_place(text, words):
    assert re.search(words, said(text))


def test_files_of_other_editors_are_read(tmp_path):
    path = tmp_path / "f.yaml"
    path.write_bytes(b"\xef\xbb\xbfa: 1\r\nb: [1,\r\n  2]\r\nc: \xc3\xa9\r\n")
    assert read_yaml(path) == {"a": 1, "b": [1, 2], "c": "é"}
    path.write_bytes("a: 1\n".encode("utf-16"))
    with pytest.raises(InputError, match="f.yaml' cannot be read: it is UTF-16 text. Save it as UTF-8"):
        read_yaml(path)
    path.write_bytes(b"a: \xe9\n")
    with pytest.raises(InputError, match=r"it is not UTF-8 text \(byte 4\)"):
        read_yaml(path)


def bomb(levels=12):
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 10)}]" for k in range(1, levels)]
    return "\n".join(lines)


HOSTILE = {
    "aliases of aliases": (bomb(), "more than 100000 keys and values"),
    "merges of merges": (
        "a0: &a0 {x: 1}\n"
        + "".join(f"a{k}: &a{k} {{<<: *a{k - 1}, l: *a{k - 1}, r: *a{k - 1}}}\n" for k in range(1, 40)),
        "more than 100000 keys and values",
    ),
    "aliases of a long text": ("a: &a " + "x" * 9000 + "\nb: [" + "*a, " * 90_000 + "]", "more than 100000"),
    "brackets": ("a: " + "[" * 10_000, "more than 50 lists and mappings stand within each other|nesting depth"),
    "braces": ("{a: " * 10_000, "more than 50 lists|nesting depth"),
    "dashes": ("- " * 10_000, "more than 50 lists"),
    "indents": ("".join(" " * k + "a:\n" for k in range(1000)), "more than 50 lists"),
    "questions": ("? " * 10_000, "more than 50 lists|stands where a key is expected"),
    "a long number": ("a: " + "1" * 10_000, "has 10000 digits; expected at most 300"),
    "a longer number": ("a: " + "1" * 100_000, "has 100000 characters; expected at most 10000"),
    "a long text": ("a: " + "x" * 3_000_000, "has 3000000 characters"),
    "a long key": ("? " + "k" * 5000 + "\n: 1", "has 5000 characters; expected at most 200"),
    "a million items": ("a: [" + "1," * 1_000_000 + "]", "more than 100000 keys and values"),
    "many keys": ("".join(f"k{k}: 1\n" for k in range(60_000)), "more than 100000 keys and values"),
}  # fmt: skip


@pytest.mark.parametrize("kind", HOSTILE)
def test_hostile_texts_are_refused_at_once(kind, parser):
    text, words = HOSTILE[kind]
    if parser == "python" and len(text) > MOST_PORTABLE:
        pytest.skip("read_yaml hands no file of this size to the slower parser")
    begun = time.process_time()
    sentence = said(text)
    assert time.process_time() - begun < MOST_SECONDS
    assert re.search(words, sentence)


def test_the_largest_text_takes_little_time(parser):
    items = MOST_PORTABLE // 25 if parser == "python" else MOST_VALUES // 8 - 1
    text = "a:\n" + "  - {k: 1.5, b: [1, 2, 3]}\n" * items
    begun = time.process_time()
    assert len(parse_yaml(text, "f.yaml")["a"]) == items
    assert time.process_time() - begun < MOST_SECONDS


def test_a_bomb_needs_little_memory():
    tracemalloc.start()
    try:
        said(bomb())
        assert tracemalloc.get_traced_memory()[1] / 1e6 < MOST_MEGABYTES
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize(
    ("kind", "words"), [("pipe", "it is a pipe"), ("folder", "it is a folder"), ("device", "it is a device"),
                        ("huge", "more than 4 MB"), ("missing", "No such file"), ("name", "name too long")],
)  # fmt: skip
def test_only_files_of_a_usual_size_are_read(kind, words, tmp_path):
    path = tmp_path / "f.yaml"
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    elif kind == "device":
        path.symlink_to("/dev/zero")
    elif kind == "huge":
        with path.open("wb") as file:
            file.truncate(10 * 2**30)
    elif kind == "name":
        path = tmp_path / ("x" * 300)
    with pytest.raises(InputError, match=f"cannot be read: .*{words}"):
        read_yaml(path)


@pytest.mark.parametrize(
    "text", ["1e5", "0o17", "09", "+.5", "010", "1:30", "on", "=", "<<", "2020-01-01", "~", "1_000"]
)
def test_what_is_written_is_read_back_by_both_versions(text):
    content = {text: [text, 1e-05, 1e16, 3, True, None, float("inf"), {"x": "é"}]}
    written = yaml_of(content)
    assert parse_yaml(written, "f.yaml") == parse_yaml(written, "f.yaml", portable=True) == content
    assert yaml.safe_load(written) == content


@pytest.mark.parametrize(
    ("text", "words"),
    [("[1", "value '[1' is not valid YAML: "), ("&a [*a]", "within its own anchor"), ("\udcff", "udcff"),
                        ("1\n---\n2", "second document")],
)  # fmt: skip
def test_values_of_the_command_line_are_read_by_the_same_rules(text, words):
    assert read_value("1e5") == 1e5 and read_value("010") == 10 and read_value("yes") == "yes"
    with pytest.raises(InputError) as caught:
        read_value(text)
    assert words in str(caught.value) and str(caught.value).isprintable()
