"""What a page may say: everything else is refused by one error."""

import contextlib
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from avalanche_gym.viewer.messages import KINDS, MalformedMessage, parse

GOOD = {
    "open": {"show": "terrain", "level": ""},
    "pause": {"on": True},
    "step": {},
    "reset": {},
    "speed": {"value": 0.25},
    "driver": {"name": "random"},
    "point_gravity": {"on": False},
    "kick": {"body": 3, "point": [0, 0.1, 0], "velocity": [1.0, 2, 3]},
    "overlays": {"contacts": True, "cells": False},
}


def text(kind, **changes):
    return json.dumps({"type": kind, **GOOD[kind], **changes})


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_understood_and_needs_exactly_its_fields(kind):
    understood = parse(text(kind))
    assert understood["type"] == kind and set(understood) == {"type", *GOOD[kind]}
    with pytest.raises(MalformedMessage):
        parse(text(kind, more=1))
    for name in GOOD[kind]:
        fields = {key: value for key, value in GOOD[kind].items() if key != name}
        with pytest.raises(MalformedMessage):
            parse(json.dumps({"type": kind, **fields}))


@pytest.mark.parametrize(
    "message",
    [
        b"{}",
        "",
        "null",
        "[]",
        "{}",
        "{",
        "[" * 2000,
        '{"type": ["pause"], "on": true}',
        '{"type": "erase"}',
        text("pause", on=1),
        text("pause", on=None),
        text("speed", value=0),
        text("speed", value=1e9),
        text("speed", value=True),
        '{"type": "speed", "value": NaN}',
        '{"type": "speed", "value": 1' + "0" * 400 + "}",
        text("open", show="x" * 1000),
        text("open", show=1),
        text("kick", body=-1),
        text("kick", body=1.0),
        text("kick", body=True),
        text("kick", body=2**40),
        text("kick", point=[0, 0]),
        text("kick", point="000"),
        text("kick", velocity=[1e6, 0, 0]),
        text("kick", velocity=[0, "1", 0]),
        '{"type": "kick", "body": 1, "point": [0, 0, Infinity], "velocity": [0, 0, 0]}',
    ],
)
def test_what_means_nothing_is_malformed(message):
    with pytest.raises(MalformedMessage):
        parse(message)


@given(st.text() | st.binary())
def test_nothing_else_is_ever_raised(message):
    with contextlib.suppress(MalformedMessage):
        parse(message)


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=4),
    max_leaves=6,
)


@given(st.sampled_from(sorted(KINDS)), st.data())
def test_nothing_else_is_raised_for_odd_values(kind, data):
    fields = {name: data.draw(json_values) for name in GOOD[kind]}
    with contextlib.suppress(MalformedMessage):
        parse(json.dumps({"type": kind, **fields}))
