"""The states of the page that the docs show can be reached; `python -m tests.modeler.screens` takes the pictures."""

import re

import pytest

from tests.modeler.conftest import ROOT
from tests.modeler.screens import IMAGES, IN_DOCS, SIZES, reach


@pytest.mark.parametrize("name", sorted(IN_DOCS.keys() - {"token"}))  # which test_files.py reaches
def test_a_state_of_the_docs_is_reached(opens, tmp_path, name):
    state = IN_DOCS[name]
    shown = opens(state.text, viewport=SIZES[state.size], color_scheme=state.theme)
    reach(shown, state, tmp_path)
    assert len(shown.page.screenshot()) > 10_000
    if name == "away":
        shown.page.unroute_all(behavior="wait")  # the page asks again by itself
        shown.complaints.clear()


def test_the_docs_show_each_picture():
    shown = re.findall(r"img/(modeler[\w-]*)\.png", (ROOT / "docs" / "modeler.md").read_text(encoding="utf-8"))
    assert sorted(shown) == sorted(state.picture for state in IN_DOCS.values())
    assert {each.stem for each in IMAGES.glob("modeler*.png")} == set(shown)
