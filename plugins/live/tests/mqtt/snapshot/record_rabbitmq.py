"""Records what the management interface of a running RabbitMQ answers: ``python -m plugins.mqtt.tests.snapshot.record_rabbitmq URL PORT``.

URL is the interface and PORT that of the MQTT plugin, both of a broker on this machine with the user `guest`. The answers are kept as they
are, but for names of machines and for counters, which differ with each run.
"""

import base64
import json
import sys
import time
from pathlib import Path
from urllib.request import Request, urlopen

import paho.mqtt.client as paho
from paho.mqtt.enums import CallbackAPIVersion

FILE = Path(__file__).with_name("rabbitmq.json")
CLIENTS = (
    ("dash board", False, 60, (("farm/+/temp", 1), ("farm/#", 0), ("a.b/c", 2))),
    ("old", True, 30, (("farm/1", 1), ("#", 0))),
    ("sensor", True, 20, ()),
    ("subscription-xqos1", False, 60, (("x*y/z", 1), ("$share/g/k", 1), ("/lead", 0))),
    ("gone", False, 60, (("left/#", 1),)),
)
PATHS = ("api/connections", "api/queues", "api/bindings")
_OF_A_RUN = ("garbage_collection", "reductions", "reductions_details", "recv_oct_details", "send_oct_details", "node")
_KEPT_OF_QUEUES = ("name", "vhost", "durable", "auto_delete", "exclusive", "arguments", "type", "state")


def connect(port, name, clean, keep_alive, filters):
    client = paho.Client(CallbackAPIVersion.VERSION2, name, protocol=paho.MQTTv311, clean_session=clean)
    client.connect("127.0.0.1", port, keep_alive)
    client.loop_start()
    time.sleep(1)
    if filters:
        client.subscribe([*filters])
        time.sleep(1)
    return client


def main(url, port):
    secret = base64.b64encode(b"guest:guest").decode()

    def get(path):
        request = Request(f"{url}/{path}", headers={"Authorization": f"Basic {secret}"})  # noqa: S310 - of this machine
        with urlopen(request, timeout=30) as answer:  # noqa: S310 - likewise
            return json.load(answer)

    *_, gone = [connect(port, *each) for each in CLIENTS]
    gone.disconnect()
    time.sleep(8)  # statistics are collected every five seconds
    answers = {path: get(path) for path in PATHS}
    answers["api/connections"] = [
        {name: value for name, value in each.items() if name not in _OF_A_RUN} for each in answers["api/connections"]
    ]
    answers["api/queues"] = [{name: each.get(name) for name in _KEPT_OF_QUEUES} for each in answers["api/queues"]]
    version = get("api/overview")["rabbitmq_version"]
    text = json.dumps({"version": version, "answers": answers}, indent=1, sort_keys=True)
    FILE.write_text(f"{text}\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
