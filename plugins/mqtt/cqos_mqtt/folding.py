"""Which clients of a broker are alike to this pack: what it reads of names, and which texts count by being equal only."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from cqos_core.packs import Folding
from cqos_mqtt.connection_policies import CLIENT_ID, SESSION, USERNAME, WILL_PAYLOAD, WILL_TOPIC
from cqos_mqtt.filters import SHARE, Trie, has_wildcards, share, wrong_with_filter, wrong_with_name
from cqos_mqtt.queues import heard
from cqos_mqtt.sessions import RESERVED

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable

_PLAIN: Final = re.compile(r"[^$+#\0\x80-\U0010ffff][^+#\0\x80-\U0010ffff]{0,9999}")


def reads(written: str) -> str:
    """Return what the pack reads of a name or filter: its bytes, and whether it is valid, shared, reserved, or has wildcards or dots."""
    # A broker may take dots for slashes; which filters then match follows from where they are.
    dotted = "/".join(each if "." in each or "*" in each else "" for each in written.split("/"))
    if _PLAIN.fullmatch(written):
        return f"{len(written)}{dotted}"
    valid = f"{wrong_with_name(written) is None:d}{wrong_with_filter(written) is None:d}"
    shared = share(written)
    kind = f"{shared is not None:d}{has_wildcards(written if shared is None else shared.filter):d}{has_wildcards(written):d}"
    # Few names begin so, and which of them the broker itself publishes is a question of the whole name.
    reserved = written if written.startswith(RESERVED) else ""
    return f"{len(written.encode(errors='replace'))} {valid}{kind}{reserved}{dotted}"


def reaches(written: str) -> bool:
    """Whether a filter matches names other than its own text."""
    return has_wildcards(written) or written.startswith(SHARE)


def finder(filters: Collection[str]) -> Callable[[str], Iterable[str]]:
    """Return what finds the filters that match a name."""
    return Trie(filters).matching


FOLDING: Final = Folding(
    reads,
    reaches,
    finder,
    heard,
    topics=(WILL_TOPIC.name,),
    shared=(CLIENT_ID.name,),
    texts={
        USERNAME.name: lambda _: "user",
        WILL_PAYLOAD.name: lambda text: "x" * len(text.encode(errors="replace")),
    },
    own=(SESSION.name,),
)
