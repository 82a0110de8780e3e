"""Codes of what the core reports about behaviour: what control flow says about time. BP104 and BP116 report nothing of their own."""

from __future__ import annotations

from typing import Final

from cqos_core.model.code_info import CodeInfo

BEHAVIOUR: Final = (
    CodeInfo(
        "BP101",
        "timer-exceeds-offered-deadline",
        "warning",
        "The timers of a process let a publisher send less often than the deadline that it offers.",
        "Subscribers and publisher then report a missed deadline again and again (DDS 1.4, 2.2.3.7). This includes loops whose "
        "every turn waits for a timer.",
        help="offer a deadline that is longer than the timer and all that the process does, or none",
    ),
    CodeInfo(
        "BP102",
        "timer-exceeds-requested-deadline",
        "warning",
        "All publishers of a topic together send less often than the deadline that a subscriber requests.",
        "The subscriber then reports a missed deadline again and again (DDS 1.4, 2.2.3.7).",
        help="request a deadline that is longer than the timer and all that the processes do, or none",
    ),
    CodeInfo(
        "BP103",
        "deadline-after-last-sample",
        "warning",
        "A publisher offers a deadline and sends a limited number of samples.",
        "After the last sample the deadline passes again and again (DDS 1.4, 2.2.3.7).",
        help="offer no deadline, or let a timer repeat what sends",
    ),
    CodeInfo(
        "BP105",
        "timer-exceeds-manual-lease",
        "warning",
        "A publisher asserts its liveliness by sending, and its timers let it send less often than the lease.",
        "It counts as lost between two samples (DDS 1.4, 2.2.3.11).",
        help="use automatic liveliness, or a lease that is longer than the timer",
    ),
    CodeInfo(
        "BP106",
        "expired-before-awaited",
        "error",
        "The only sample is older than its lifespan before a token waits for it.",
        "It is removed at both ends, so the event never happens (DDS 1.4, 2.2.3.16).",
        help="let the sample live longer, or wait for it before the timer",
    ),
    CodeInfo(
        "BP107",
        "sent-before-awaited",
        "warning",
        "The only sample is sent before a token waits for it, and it is not kept for later subscribers.",
        "BPMN keeps no signal (BPMN 2.0.2, 10.5). Middleware may keep it in a queue.",
        help="let the process wait for the signal earlier, or let both ends keep it; the option `bpmn.catch` says "
        "what the middleware does",
    ),
    CodeInfo(
        "BP108",
        "answer-of-an-earlier-round",
        "note",
        "A process may take the answer to an earlier request for the answer to this one.",
        "The topic keeps samples for later subscribers, and the answer lives for longer than a round of the process.",
        help="let the answer live for less than a round, or do not keep it for later subscribers",
    ),
    CodeInfo(
        "BP109",
        "burst-exceeds-queue",
        "error",
        "Several samples are sent at once, the queue keeps fewer, and the subscriber requires that none is lost.",
        "Samples that are not delivered yet are replaced by newer ones (DDS 1.4, 2.2.3.18).",
        help="let both ends keep as many samples as are sent at once",
    ),
    CodeInfo(
        "BP110",
        "never-thrown",
        "error",
        "No run of the processes publishes on a topic that has publishers and subscribers.",
        "Each event that throws the signal waits for something that never happens, often for each other. The pair is compatible and "
        "nothing is ever sent.",
        help="give one of the processes in the message a start that does not wait for the others",
    ),
    CodeInfo(
        "BP111",
        "unreachable-throw",
        "error",
        "An event throws a signal, and no token ever reaches it, though its process runs.",
        "All ways to it pass something that never happens (BPMN 2.0.2, 13.2 to 13.5).",
        help="connect the event with what happens, or remove it",
    ),
    CodeInfo(
        "BP112",
        "unreachable-catch",
        "warning",
        "An event waits for a signal, and no token ever reaches it, though its process runs.",
        "All ways to it pass something that never happens (BPMN 2.0.2, 13.2 to 13.5).",
        help="connect the event with what happens, or remove it",
    ),
    CodeInfo(
        "BP113",
        "timeout-before-answer",
        "warning",
        "A gateway waits for an answer or a timer, and the timer is due before the answer can come.",
        "The other side waits for a longer timer before it answers.",
        help="wait longer than the other side needs, or let it answer earlier",
    ),
    CodeInfo(
        "BP114",
        "timer-exceeds-required-gap",
        "error",
        "A subscriber requires samples more often than all publishers of the topic together send.",
        "The requirement `max_gap` is certainly not met.",
        help="let a timer send more often, or require less",
    ),
    CodeInfo(
        "BP115",
        "owner-misses-deadline",
        "warning",
        "The strongest exclusive publisher of a topic sends less often than the deadline that it offers.",
        "Ownership passes to another publisher each time that the deadline is missed (DDS 1.4, 2.2.3.9.2).",
        help="offer no deadline, or let the timer be shorter than it",
    ),
    CodeInfo(
        "BP117",
        "kept-for-a-restart-only",
        "note",
        "Samples are kept for later subscribers, and the subscriber exists from the start of its device.",
        "Kept samples then come only after a restart of the device.",
        help="use volatile durability, unless restarts matter",
    ),
    CodeInfo(
        "BP118",
        "taken-once-kept-for-ever",
        "warning",
        "A process takes one sample in its life, and both ends keep all samples of a publisher that never stops.",
        "Nothing takes the later samples, so the queue of the reader fills and the reliable writer blocks (DDS 1.4, 2.2.3.14, 2.2.3.18).",
        help="keep the last samples only, or wait for the signal again",
    ),
)
