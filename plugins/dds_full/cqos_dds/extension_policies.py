"""What implementations add to the QoS of the standard, as far as it decides who matches whom."""

from __future__ import annotations

from typing import Final

from cqos_core.packs import Anything, Choice, Flag, PerRole, Policy, by_option
from cqos_dds.implementations import CYCLONE_DDS
from cqos_dds.kinds import Compressions

_WRITER_READER: Final = ("writer", "reader")
_ALL: Final = "[zlib, bzip2, lz4]"
_NOT_CONNEXT: Final = (
    *CYCLONE_DDS,
    "fastdds_2_9",
    "fastdds_3_1",
    "fastdds_3_6",
    "opendds",
    "dust",
    "rustdds",
)

DISABLE_POSITIVE_ACKS: Final = Policy(
    "disable_positive_acks",
    Flag(),
    "false",
    "Whether a reliable reader reports only what it misses, and a writer forgets samples after a time instead of waiting for "
    "acknowledgements.",
    "Fast DDS, DisablePositiveACKsQosPolicy; RTI Connext, DATA_WRITER_PROTOCOL and DATA_READER_PROTOCOL",
    aliases=("disable_positive_acks.enabled", "disablePositiveAcks"),
    enforced={"implementation": dict.fromkeys((*CYCLONE_DDS, "opendds", "dust", "rustdds"), "no")},
    entities=_WRITER_READER,
    changeable=False,
    unseen=True,
)
TOPIC_KIND: Final = Policy(
    "topic_kind",
    Choice("no_key", "with_key", ordered=False),
    None,
    "Whether the data type that this end uses has a key, where the two ends may differ.",
    "DDSI-RTPS 2.5, 9.3.1.2",
    aliases=("topic.kind",),
    entities=_WRITER_READER,
    changeable=False,
    unseen=True,
)
COMPRESSION: Final = Policy(
    "compression_ids",
    Compressions(),
    "default",
    "How a writer of RTI Connext compresses samples, and what a reader can decompress. By default a writer does not compress "
    "and a reader of RTI Connext takes all.",
    "RTI Connext, DATA_REPRESENTATION, compression_settings",
    aliases=("compression", "compression_settings.compression_ids", "data_representation.compression_settings"),
    words={
        "default": PerRole(
            publisher="[]",
            subscriber=by_option("implementation", otherwise=_ALL, **dict.fromkeys(_NOT_CONNEXT, "[]")),
        )
    },
    enforced={"implementation": dict.fromkeys(_NOT_CONNEXT, "no")},
    entities=_WRITER_READER,
    changeable=False,
    unseen=True,
)
MAY_LOSE: Final = "may_lose"
EXTENSIONS: Final = Policy(
    "extensions",
    Choice("none", MAY_LOSE, "refusing", ordered=False),
    "none",
    "What QoS that C-QoS does not model does to this end: nothing, it may lose samples, or it keeps the end from matching. It is "
    "unknown where a file has an element that may prevent a match; `none` states that it does not.",
    "C-QoS, elements that are not modelled",
    words={"unknown": Anything("the QoS has elements that C-QoS does not model")},
    entities=("writer", "reader", "publisher", "subscriber"),
    unseen=True,
)
