"""What the importers of DDS files report, under permanent codes: DDS9xx."""

from __future__ import annotations

from typing import Final

from cqos_core.model.code_info import CodeInfo

CODES: Final = (
    CodeInfo(
        "DDS901",
        "extension-not-read",
        "note",
        "Elements of an XML file that are no policy of the standard are passed over.",
        "They belong to one implementation, or to what is not checked here, such as transports and content filters. They "
        "are listed once for each file. The coverage names those that may keep participants apart.",
    ),
    CodeInfo(
        "DDS902",
        "policy-misspelt",
        "warning",
        "An element looks like the name of a policy, but is none, so what it says does not count.",
        "Some implementations pass over what they do not know, others refuse the whole file.",
    ),
    CodeInfo(
        "DDS903",
        "policy-misplaced",
        "warning",
        "A policy stands in the QoS of an entity that does not have it, so what it says does not count.",
        "PARTITION and PRESENTATION are of publishers and subscribers, LIFESPAN is of writers, TIME_BASED_FILTER of readers.",
    ),
    CodeInfo(
        "DDS904",
        "built-in-base-unknown",
        "warning",
        "A profile is based on one that is built into RTI Connext, and what that sets is not known here.",
        "Whatever the profile does not state itself is unknown: no default is assumed in its place.",
        help="state in the file what counts",
    ),
    CodeInfo(
        "DDS905",
        "reference-leads-nowhere",
        "error",
        "A participant, an endpoint or a topic refers to something that the file does not define.",
        "Domains, topics and participants are looked up within one file. Without the domain, its number is unknown.",
        help="define it in the same file",
    ),
    CodeInfo(
        "DDS906",
        "participant-based-on-itself",
        "error",
        "Participants or domains are based on each other in a circle.",
        "No implementation can load them; what lies in the circle is read without its base.",
    ),
    CodeInfo(
        "DDS907",
        "reference-to-another-file",
        "warning",
        "A participant, an endpoint or a topic refers to a library that no file has that was read, or by a variable.",
        "Systems of DDS-XML may span files. What the other file says is unknown here, and what meets it may be there.",
        help="name the file with the library beside this one, or state the variable with `--define`",
        leaves_out="reference",
    ),
    CodeInfo(
        "DDS908",
        "several-routing-services",
        "warning",
        "A file configures several routing services, and an option of the command line says which of them runs.",
        "None of them is read, because routes that do not run would hide that participants of two domains never meet.",
        help="keep the service that runs in a file of its own",
    ),
    CodeInfo(
        "DDS909",
        "opendds-setting-not-read",
        "note",
        "A configuration of OpenDDS has endpoints or settings that C-QoS does not read and that may decide.",
        "C-QoS reads the lease of participants. The coverage names static endpoints, and what may keep participants apart.",
    ),
)
