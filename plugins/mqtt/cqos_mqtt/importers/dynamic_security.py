"""Reads the file of Mosquitto's dynamic security plugin: which users may publish and subscribe what, as lines of access control.

The plugin decides by the first entry of the roles of a client that matches, in the order of priorities, else by defaults. Where all entries
allow, their order does not matter, and they are lines of `acl`. Where that is not so, the reason is returned in place of lines.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Final

from cqos_core.model.grouping import grouped
from cqos_mqtt.filters import has_wildcards
from cqos_mqtt.sessions import EVERY_USER, NO_USER

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from cqos_core.model.source import Source

PLUGIN: Final = "dynamic_security"
"""Part of the name of the plugin, wherever it is installed."""
_SENDS: Final = "publishClientSend"
_RECEIVES: Final = "publishClientReceive"
_SUBSCRIBES: Final = ("subscribePattern", "subscribeLiteral")
_NOTHING: Final = f"deny {EVERY_USER} #"


class UnclearAccessError(ValueError):
    """What the file says cannot be said in lines of access control; the text is the reason."""


def access_of(source: Source) -> list[str]:
    """Return the lines of access control that a file amounts to.

    Raises:
        UnclearAccessError: it is of another form, or lines cannot say what it says.
    """
    document = _document(source)
    defaults = {name: bool(value) for name, value in (document.get("defaultACLAccess") or {}).items()}
    found = []
    if defaults.get(_SENDS):
        found.append(f"write {EVERY_USER} #")
    if defaults.get("subscribe") and defaults.get(_RECEIVES):
        found.append(f"read {EVERY_USER} #")
    for user, entries in _entries_of_users(document):
        who = user.replace(" ", "_")
        sends = [each["topic"] for each in entries if each["acltype"] == _SENDS]
        found += [f"write {who} {topic}" for topic in sends]
        found += [f"read {who} {topic}" for topic in _readable(entries, defaults)]
    return [*dict.fromkeys(found)] or [_NOTHING]


def users_of(source: Source) -> list[str]:
    """Return the names of the users that may log in.

    Raises:
        UnclearAccessError: the file is of another form.
    """
    return sorted(str(each["username"]) for each in _active(_document(source)))


def _document(source: Source) -> dict[str, Any]:
    try:
        found = json.loads(source.data)
    except (ValueError, RecursionError):
        raise UnclearAccessError("it is no JSON") from None
    if not isinstance(found, dict) or not all(
        isinstance(each.get("username"), str) for each in _list(found, "clients")
    ):
        raise UnclearAccessError("it is no file of the dynamic security plugin")
    return found


def _list(document: dict[str, Any], name: str) -> list[dict[str, Any]]:
    found = document.get(name) or []
    if not isinstance(found, list) or not all(isinstance(each, dict) for each in found):
        raise UnclearAccessError(f"`{name}` in it is no list of maps")
    return found


def _active(document: dict[str, Any]) -> Iterator[dict[str, Any]]:
    return (each for each in _list(document, "clients") if not each.get("disabled"))


def _entries_of_users(document: dict[str, Any]) -> Iterator[tuple[str, list[dict[str, Any]]]]:
    """Yield each user with the entries of all its roles, also those of its groups."""
    roles = {str(each.get("rolename")): _list(each, "acls") for each in _list(document, "roles")}
    groups = {str(each.get("groupname")): _names(each, "roles", "rolename") for each in _list(document, "groups")}
    members = grouped(
        (name, str(group.get("groupname")))
        for group in _list(document, "groups")
        for name in _names(group, "clients", "username")
    )
    for client in _active(document):
        name = client["username"]
        its = {*_names(client, "groups", "groupname"), *members.get(name, ())}
        mine = [
            *_names(client, "roles", "rolename"),
            *(role for group in sorted(its) for role in groups.get(group, ())),
        ]
        yield name, [_clear(each) for role in mine for each in roles.get(role, ())]
    anonymous = document.get("anonymousGroup")
    if anonymous in groups:
        yield NO_USER, [_clear(each) for role in groups[anonymous] for each in roles.get(role, ())]


def _names(node: dict[str, Any], key: str, name: str) -> list[str]:
    return [str(each.get(name)) for each in _list(node, key)]


def _clear(entry: dict[str, Any]) -> dict[str, Any]:
    """Return an entry that a line of access control can express."""
    kind, topic = entry.get("acltype"), entry.get("topic")
    if not isinstance(topic, str) or not isinstance(kind, str):
        raise UnclearAccessError("an entry of a role has no `acltype` or no `topic`")
    if "unsubscribe" in kind:
        return {"acltype": kind, "topic": topic}
    if not entry.get("allow"):
        raise UnclearAccessError(f"a role denies `{topic}` ({kind}), and which entry counts depends on priorities")
    if "%c" in topic or "%u" in topic:
        raise UnclearAccessError(f"`{topic}` has marks whose meaning depends on the version of Mosquitto")
    if kind == "subscribeLiteral" and has_wildcards(topic):
        raise UnclearAccessError(f"`{topic}` may be subscribed as it stands only (subscribeLiteral)")
    return {"acltype": kind, "topic": topic}


def _readable(entries: Iterable[dict[str, Any]], defaults: dict[str, bool]) -> list[str]:
    """Return what a user may subscribe and is sent; both are checked."""
    subscribes = {each["topic"] for each in entries if each["acltype"] in _SUBSCRIBES}
    receives = {each["topic"] for each in entries if each["acltype"] == _RECEIVES}
    if defaults.get(_RECEIVES) or "#" in receives or subscribes <= receives:
        return sorted(subscribes)
    if defaults.get("subscribe") or "#" in subscribes:
        return sorted(receives)
    if not receives:
        return []
    raise UnclearAccessError("what a role may subscribe and what it may be sent are different filters")
