"""The policies of DDS that say which samples are kept: history, limits and the durability service."""

from __future__ import annotations

from typing import Final

from cqos_core.packs import (
    Flag,
    Policy,
    by_option,
)
from cqos_dds.kinds import choice, duration, length
from cqos_dds.requested_policies import READER, TOPIC_WRITER, TOPIC_WRITER_READER, WRITER

# What is kept ----------------------------------------------------------------------------------------------

HISTORY: Final = Policy(
    "history",
    choice("HISTORY", "keep_last", "keep_all"),
    "keep_last",
    "How many samples of an instance are kept: the last `history.depth` ones, or all that resources allow.",
    "DDS 1.4, 2.2.3.18",
    aliases=("history.kind",),
    entities=TOPIC_WRITER_READER,
    changeable=False,
    stronger="higher",
)
DEPTH: Final = Policy(
    "history.depth",
    length(),
    "1",
    "How many samples of an instance keep_last keeps.",
    "DDS 1.4, 2.2.3.18",
    aliases=("depth", "history_depth"),
    entities=TOPIC_WRITER_READER,
    changeable=False,
    stronger="higher",
)


def limit(field: str, unit: str, doc: str, before_fast_dds_3_5: str) -> Policy:
    """Return a field of RESOURCE_LIMITS."""
    words = {
        "default": by_option(
            "implementation", otherwise="unlimited", fastdds_2_9=before_fast_dds_3_5, fastdds_3_1=before_fast_dds_3_5
        )
    }
    return Policy(
        f"resource_limits.{field}",
        length(unit),
        "default",
        f"{doc} The default is unlimited; Fast DDS before 3.5 has {before_fast_dds_3_5}.",
        "DDS 1.4, 2.2.3.19",
        aliases=(field,),
        words=words,
        entities=TOPIC_WRITER_READER,
        changeable=False,
        stronger="higher",
    )


MAX_SAMPLES: Final = limit("max_samples", "samples", "The most samples an endpoint keeps.", "5000")
MAX_INSTANCES: Final = limit("max_instances", "instances", "The most instances an endpoint keeps.", "10")
MAX_PER_INSTANCE: Final = limit(
    "max_samples_per_instance", "samples", "The most samples an endpoint keeps of one instance.", "400"
)
CLEANUP_DELAY: Final = Policy(
    "durability_service.service_cleanup_delay",
    duration(),
    "0s",
    "How long a durability service remembers an instance that is disposed and has no writers.",
    "DDS 1.4, 2.2.3.5",
    roles=WRITER,
    aliases=("service_cleanup_delay",),
    entities=TOPIC_WRITER,
    changeable=False,
)
SERVICE_HISTORY: Final = Policy(
    "durability_service.history_kind",
    choice("HISTORY", "keep_last", "keep_all"),
    "keep_last",
    "What a durability service keeps of an instance. Cyclone DDS keeps by it what transient_local writers replay.",
    "DDS 1.4, 2.2.3.5",
    roles=WRITER,
    aliases=("history_kind",),
    entities=TOPIC_WRITER,
    changeable=False,
    stronger="higher",
)
SERVICE_DEPTH: Final = Policy(
    "durability_service.history_depth",
    length(),
    "1",
    "How many samples of an instance a durability service keeps with keep_last.",
    "DDS 1.4, 2.2.3.5",
    roles=WRITER,
    entities=TOPIC_WRITER,
    changeable=False,
    stronger="higher",
)


def service_limit(field: str, unit: str, doc: str) -> Policy:
    """Return a limit of DURABILITY_SERVICE."""
    return Policy(
        f"durability_service.{field}",
        length(unit),
        "unlimited",
        doc,
        "DDS 1.4, 2.2.3.5",
        roles=WRITER,
        entities=TOPIC_WRITER,
        changeable=False,
        stronger="higher",
    )


SERVICE_MAX_SAMPLES: Final = service_limit("max_samples", "samples", "The most samples a durability service keeps.")
SERVICE_MAX_INSTANCES: Final = service_limit(
    "max_instances", "instances", "The most instances a durability service keeps."
)
SERVICE_MAX_PER_INSTANCE: Final = service_limit(
    "max_samples_per_instance", "samples", "The most samples a durability service keeps of one instance."
)
LIFESPAN: Final = Policy(
    "lifespan",
    duration(),
    "infinite",
    "How old a sample may be when it is delivered; older ones are dropped.",
    "DDS 1.4, 2.2.3.16",
    roles=WRITER,
    aliases=("lifespan.duration",),
    entities=TOPIC_WRITER,
    changeable=True,
)
AUTODISPOSE: Final = Policy(
    "writer_data_lifecycle",
    Flag(),
    "true",
    "Whether an instance that its writer unregisters, also by ending, is disposed for all readers.",
    "DDS 1.4, 2.2.3.21",
    roles=WRITER,
    aliases=("writer_data_lifecycle.autodispose_unregistered_instances", "autodispose_unregistered_instances"),
    entities=("writer",),
    changeable=True,
)
AUTOPURGE_NOWRITER: Final = Policy(
    "reader_data_lifecycle.autopurge_nowriter_samples_delay",
    duration(),
    "infinite",
    "How long a reader keeps an instance that has no writer any more.",
    "DDS 1.4, 2.2.3.22",
    roles=READER,
    aliases=("autopurge_nowriter_samples_delay",),
    entities=("reader",),
    changeable=True,
)
AUTOPURGE_DISPOSED: Final = Policy(
    "reader_data_lifecycle.autopurge_disposed_samples_delay",
    duration(),
    "infinite",
    "How long a reader keeps an instance that was disposed.",
    "DDS 1.4, 2.2.3.22",
    roles=READER,
    aliases=("autopurge_disposed_samples_delay",),
    entities=("reader",),
    changeable=True,
)
