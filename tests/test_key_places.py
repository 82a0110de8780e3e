"""The place of a key beside its value, also in a file that is one long line."""

from cqos_core.model.excerpt import exact
from cqos_core.model.settings import Place
from tests.growth.linear import assert_linear


def keys(number):
    """One line of JSON, and the place of each of its values."""
    text, places = "{", []
    for index in range(number):
        text += f'"key{index}": '
        places.append(Place("a.json", line=1, column=len(text) + 1, path=f"key{index}:"))
        text += '"x", '
    return text.encode(), places


def test_each_key_is_found_before_its_value():
    data, places = keys(500)
    for index, place in enumerate(places):
        (found,) = exact([place], {"a.json": data}).values()
        assert data[(found.column or 0) - 1 :].startswith(f'key{index}"'.encode())


def test_the_last_key_of_that_name_before_the_value_counts():
    data = b"{a: {depth: 1}, b: {depth: 22" + b" " * 2000 + b"}, c: {depth: 3}}"
    value = Place("a.yaml", line=1, column=data.index(b"}, c") + 1, path="depth:")
    (found,) = exact([value], {"a.yaml": data}).values()
    assert found.column == data.index(b"depth: 22") + 1


def test_many_keys_on_one_line_cost_what_they_hold():
    def find(size):
        data, places = keys(size)
        exact(places, {"a.json": data})

    assert_linear(find, 1_000)
