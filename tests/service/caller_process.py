"""A caller of the service in a process of its own: ``python -m tests.service.caller_process ADDRESS KIND NUMBER [TOKEN]``.

It writes ``ready``, begins when it reads a line, and writes the time and the result of each answer. Its clock is that of
all processes of the machine.
"""

import queue
import sys
import threading
import time
from typing import Any

import grpc

from cqos.v1 import check_pb2, check_pb2_grpc, session_pb2, session_pb2_grpc
from tests.service.test_robustness import system

HEAVY = 200


def heavy(number):
    """A model that takes a worker some tenth of a second, and that no caller has sent before."""
    model = system(HEAVY, topics=HEAVY // 2, varied=True, lifespan=f"{number + 1}s")
    return check_pb2.CheckSystemRequest(system=model)


def small(number):
    """A document, which a worker reads in some milliseconds."""
    text = f"cqos: 1\nprotocol: ros2\nparticipants: {{a: {{publishes: {{t: {{depth: {number + 1}}}}}}}}}\n"
    return check_pb2.CheckDocumentRequest(documents=[check_pb2.Document(content=text.encode())])


def tell(code):
    sys.stdout.write(f"{time.monotonic()} {code}\n")
    sys.stdout.flush()


class Caller:
    def __init__(self, address, token):
        self.channel = grpc.insecure_channel(address)
        self.checks: Any = check_pb2_grpc.CheckServiceStub(self.channel)
        self.sessions: Any = session_pb2_grpc.SessionServiceStub(self.channel)
        self.given: dict[str, Any] = {
            "timeout": 120,
            "metadata": [("authorization", f"Bearer {token}")] if token else [],
        }
        self.checks.CheckPair(check_pb2.CheckPairRequest(protocol="ros2"), **self.given)

    def flood(self, number):
        """Send so many heavy calls at once."""
        under_way = [self.checks.CheckSystem.future(heavy(each), **self.given) for each in range(number)]
        answered: queue.SimpleQueue[Any] = queue.SimpleQueue()
        for each in under_way:
            each.add_done_callback(answered.put)
        for _ in under_way:
            done = answered.get()
            tell(f"{done.code().name} {done.details()}")

    def trickle(self, number):
        """Send so many small ones, each after the answer to the one before."""
        for each in range(number):
            self.checks.CheckDocument(small(each), **self.given)
            tell("OK")

    def pairs(self, number):
        """Ask for pairs one after the other."""
        for each in range(number):
            topic = {"name": f"p{each}"}
            self.checks.CheckPair(check_pb2.CheckPairRequest(protocol="ros2", topic=topic), **self.given)
            tell("OK")

    def streams(self, number):
        """Ask for pairs over so many streams at once, without end."""

        def stream(which):
            requests = (
                check_pb2.CheckPairsRequest(
                    pair=check_pb2.CheckPairRequest(protocol="ros2", topic={"name": f"s{which}x{each}"})
                )
                for each in range(100_000)
            )
            for _ in self.checks.CheckPairs(requests, **self.given):
                tell("OK")

        threads = [threading.Thread(target=stream, args=(which,), daemon=True) for which in range(number)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()

    def edits(self, number):
        """Edit so many large sessions at once, without end."""
        self._edited([HEAVY] * number, 1_000)

    def drawing(self, number):
        """Edit one small session so many times."""
        self._edited([2], number)

    def _edited(self, sizes, number):
        def edit(size):
            sent: queue.SimpleQueue[Any] = queue.SimpleQueue()
            answers = self.sessions.Edit(iter(sent.get, None), **self.given)
            sent.put(session_pb2.EditRequest(open=system(size, topics=max(size // 2, 1), varied=True)))
            next(answers)
            for each in range(number):
                option = session_pb2.OptionChange(pack="ros2", name="domain", value=str(each % 100))
                sent.put(
                    session_pb2.EditRequest(
                        changes=session_pb2.Changes(changes=[session_pb2.Change(set_option=option)])
                    )
                )
                next(answers)
                tell("OK")

        threads = [threading.Thread(target=edit, args=(size,), daemon=True) for size in sizes]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()


def main(address, kind, number, token=""):
    caller = Caller(address, token)
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    sys.stdin.readline()
    try:
        getattr(caller, kind)(int(number))
    except grpc.RpcError as error:
        answer: Any = error
        tell(f"{answer.code().name} {answer.details()}")


if __name__ == "__main__":
    main(*sys.argv[1:])
