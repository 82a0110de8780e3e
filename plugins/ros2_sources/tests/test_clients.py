"""Clients of MQTT from their sources, in the four libraries that the tables name. Sources are our own."""

from __future__ import annotations

import pytest

from cqos_core.cli.app import run as command
from cqos_ros2_sources.walk.call_tables import tables
from cqos_ros2_sources.walk.clients import learn_clients

pytestmark = pytest.mark.usefixtures("parser")

PAHO_PYTHON = r"""
import json, os, random
import paho.mqtt.client as mqtt

BASE = "plant"
TOPIC = f"{BASE}/hall/temperature"


def on_connect(client, userdata, flags, reason_code, properties):
    client.subscribe([(BASE + "/hall/set", 1), (f"{BASE}/all/#", 0)])
    client.subscribe(os.environ["EXTRA"], 2)


def connect_mqtt():
    client = mqtt.Client(mqtt.CallbackAPIVersion.VERSION2, client_id="sensor-7", clean_session=False)
    client.on_connect = on_connect
    client.will_set(BASE + "/hall/gone", "gone", qos=1, retain=True)
    client.connect(os.environ.get("BROKER", "localhost"), 1883, 30)
    return client


def run():
    client = connect_mqtt()
    client.loop_start()
    while True:
        client.publish(TOPIC, json.dumps({"t": random.random()}), qos=1)
        client.publish("plant/hall/state", "on", 1, True)


if __name__ == "__main__":
    run()
"""
PAHO_CLASS = r"""
from paho.mqtt import client as mqtt


class Display:
    def __init__(self, name):
        self.client = mqtt.Client(name)
        self.client.on_message = self.on_message
        self.client.on_connect = self._connected

    def start(self):
        self.client.connect("broker", keepalive=15)
        self.client.loop_forever()

    def _connected(self, client, userdata, flags, rc):
        self.client.subscribe("plant/+/temperature", qos=2)

    def on_message(self, client, userdata, message):
        self.client.publish("display/seen", message.payload)


display = Display("display")
display.start()
"""
ARDUINO = r"""
#include <PubSubClient.h>
#define TOPIC_OUT "home/door"
WiFiClient net;
PubSubClient client(net);
char buffer[10];
void callback(char* topic, byte* payload, unsigned int length) { client.publish("home/echo", "x"); }
void reconnect() {
  while (!client.connected()) {
    if (client.connect("door-1", "user", "pw", "home/door/gone", 1, true, "gone")) {
      client.publish(TOPIC_OUT, "hello", true);
      client.subscribe("home/door/set", 1);
    } else { delay(5000); }
  }
}
void setup() { client.setServer("broker", 1883); client.setCallback(callback); client.setKeepAlive(60); }
void loop() { if (!client.connected()) { reconnect(); } client.loop(); client.publish("home/door/raw", buffer, 10); }
"""
ESP = r"""
static const char *TAG = "x";
static void handler(void *args, esp_event_base_t base, int32_t event_id, void *event_data) {
  esp_mqtt_event_handle_t event = event_data;
  esp_mqtt_client_handle_t client = event->client;
  switch ((esp_mqtt_event_id_t)event_id) {
  case MQTT_EVENT_CONNECTED:
    esp_mqtt_client_publish(client, "/topic/qos1", "data_3", 0, 1, 0);
    esp_mqtt_client_subscribe(client, "/topic/qos0", 0);
    break;
  default: break;
  }
}
static void mqtt_app_start(void) {
  esp_mqtt_client_config_t mqtt_cfg = {
    .broker.address.uri = CONFIG_BROKER_URL,
    .credentials.client_id = "esp-1",
    .session = { .keepalive = 20, .disable_clean_session = true, .last_will = { .topic = "/gone", .qos = 2 } },
  };
  mqtt_cfg.session.last_will.retain = 1;
  esp_mqtt_client_handle_t client = esp_mqtt_client_init(&mqtt_cfg);
  esp_mqtt_client_register_event(client, ESP_EVENT_ANY_ID, handler, NULL);
  esp_mqtt_client_start(client);
}
void app_main(void) { mqtt_app_start(); }
"""
PAHO_C = r"""
#include "MQTTClient.h"
#define ADDRESS "tcp://localhost:1883"
#define CLIENTID "ExampleClientPub"
#define TOPIC "MQTT Examples"
#define QOS 1
int main(int argc, char* argv[]) {
    MQTTClient client;
    MQTTClient_connectOptions conn_opts = MQTTClient_connectOptions_initializer;
    MQTTClient_willOptions will_opts = MQTTClient_willOptions_initializer;
    MQTTClient_message pubmsg = MQTTClient_message_initializer;
    MQTTClient_deliveryToken token;
    int rc;
    if ((rc = MQTTClient_create(&client, ADDRESS, CLIENTID, MQTTCLIENT_PERSISTENCE_NONE, NULL)) != MQTTCLIENT_SUCCESS) { return 1; }
    conn_opts.keepAliveInterval = 20;
    conn_opts.cleansession = 0;
    will_opts.topicName = "gone"; will_opts.message = "x"; will_opts.qos = 1;
    conn_opts.will = &will_opts;
    if ((rc = MQTTClient_connect(client, &conn_opts)) != MQTTCLIENT_SUCCESS) { return 1; }
    pubmsg.qos = QOS;
    pubmsg.retained = 0;
    if ((rc = MQTTClient_publishMessage(client, TOPIC, &pubmsg, &token)) != MQTTCLIENT_SUCCESS) { return 1; }
    MQTTClient_subscribe(client, "a/b", 2);
    MQTTClient_subscribe(client, argv[1], 2);
    return rc;
}
"""
PAHO_CPP = r"""
#include "mqtt/async_client.h"
const std::string SERVER{"mqtt://localhost:1883"}, CLIENT_ID{"paho_cpp"}, TOPIC{"hello"};
const int QOS = 1;
int main(int argc, char* argv[]) {
  mqtt::async_client cli(SERVER, CLIENT_ID);
  auto connOpts = mqtt::connect_options_builder().keep_alive_interval(std::chrono::seconds(20)).clean_session(false).finalize();
  cli.connect(connOpts)->wait();
  mqtt::message_ptr pubmsg = mqtt::make_message(TOPIC, "payload");
  pubmsg->set_qos(QOS);
  cli.publish(pubmsg)->wait_for(TIMEOUT);
  cli.publish("other", "x", 2, true);
  cli.subscribe("in/#", QOS);
}
"""


@pytest.fixture
def clients(tmp_path):
    """Return the function that learns the clients of one file: settings, endpoints and gaps of each."""

    def of(name, source):
        path = tmp_path / "house" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(source)
        found = learn_clients(str(tmp_path / "house"), tables((), "mqtt"), "mqtt")
        stated = {
            each.id: {name: "?" if value.unknown else value.text for name, value in each.settings.items()}
            for each in found.system.participants.values()
        }
        endpoints = {
            (each.role, each.topic): {
                name: "?" if value.unknown else value.text for name, value in each.settings.items()
            }
            for each in found.system.endpoints
        }
        return stated, endpoints, found.gaps

    return of


def test_paho_of_python(clients):
    stated, endpoints, gaps = clients("sensor.py", PAHO_PYTHON)
    will = "{qos: 1, retain: true, topic: plant/hall/gone}"
    assert stated == {"sensor": {"client_id": "sensor-7", "clean_session": "false", "keep_alive": "30", "will": will}}
    assert endpoints == {
        ("publisher", "plant/hall/temperature"): {"qos": "1", "retain": "false"},
        ("publisher", "plant/hall/state"): {"qos": "1", "retain": "true"},
        ("subscriber", "plant/hall/set"): {"qos": "1"},
        ("subscriber", "plant/all/#"): {"qos": "0"},
    }
    assert [what for what, _, _ in gaps] == ["what `sensor` subscribes"]


def test_paho_of_python_in_a_class(clients):
    stated, endpoints, gaps = clients("display.py", PAHO_CLASS)
    assert stated == {"display": {"client_id": "display", "keep_alive": "15"}}
    assert endpoints == {
        ("publisher", "display/seen"): {"qos": "0", "retain": "false"},
        ("subscriber", "plant/+/temperature"): {"qos": "2"},
    }
    assert not gaps


def test_pubsubclient(clients):
    stated, endpoints, gaps = clients("door.ino", ARDUINO)
    will = "{qos: 1, retain: true, topic: home/door/gone}"
    assert stated == {"door": {"client_id": "door-1", "clean_session": "true", "keep_alive": "60", "will": will}}
    assert endpoints == {
        ("publisher", "home/door"): {"qos": "0", "retain": "true"},
        ("publisher", "home/door/raw"): {"qos": "0", "retain": "false"},
        ("publisher", "home/echo"): {"qos": "0", "retain": "false"},
        ("subscriber", "home/door/set"): {"qos": "1"},
    }
    assert not gaps


def test_esp_mqtt(clients):
    stated, endpoints, gaps = clients("main/app_main.c", ESP)
    will = "{qos: 2, retain: true, topic: /gone}"
    assert stated == {"app_main": {"client_id": "esp-1", "clean_session": "false", "keep_alive": "20", "will": will}}
    assert endpoints == {
        ("publisher", "/topic/qos1"): {"qos": "1", "retain": "false"},
        ("subscriber", "/topic/qos0"): {"qos": "0"},
    }
    assert not gaps


def test_paho_of_c(clients):
    stated, endpoints, gaps = clients("publish.c", PAHO_C)
    will = "{qos: 1, retain: false, topic: gone}"
    known = {"client_id": "ExampleClientPub", "clean_session": "false", "keep_alive": "20", "will": will}
    assert stated == {"publish": known}
    assert endpoints == {
        ("publisher", "MQTT Examples"): {"qos": "1", "retain": "false"},
        ("subscriber", "a/b"): {"qos": "2"},
    }
    assert [what for what, _, _ in gaps] == ["what `publish` subscribes"]


def test_paho_of_cpp(clients):
    stated, endpoints, gaps = clients("client.cpp", PAHO_CPP)
    assert stated == {"client": {"client_id": "paho_cpp", "clean_session": "false", "keep_alive": "?"}}
    assert endpoints == {
        ("publisher", "hello"): {"qos": "1", "retain": "false"},
        ("publisher", "other"): {"qos": "2", "retain": "true"},
        ("subscriber", "in/#"): {"qos": "1"},
    }
    assert not gaps


@pytest.mark.parametrize(
    ("line", "known"),
    [
        ("client.publish(topic(), 'x', qos=level())", None),
        ("client.publish('a', 'x', qos=level())", {"qos": "?", "retain": "false"}),
        ("client.publish('a', 'x', 2)", {"qos": "2", "retain": "false"}),
        ("client.publish('a', 'x', *rest)", {"qos": "?", "retain": "?"}),
        ("client.publish('a', 'x', **rest)", {"qos": "?", "retain": "?"}),
    ],
)
def test_what_is_not_stated_plainly_is_not_known(clients, line, known):
    _, endpoints, gaps = clients("one.py", f"import paho.mqtt.client as mqtt\nclient = mqtt.Client()\n{line}\n")
    assert endpoints == ({} if known is None else {("publisher", "a"): known})
    assert bool(gaps) is (known is None)


def test_a_client_that_nothing_makes_is_named(clients):
    _, endpoints, gaps = clients(
        "one.py", "import paho.mqtt.client as mqtt\ndef f(client):\n    client.subscribe('a')\n"
    )
    assert not endpoints
    assert gaps == []  # no client of the library is in the program, and any object may have a method of that name


@pytest.mark.parametrize(
    "content",
    [
        b"import paho.mqtt.client\ndef (",
        b"\xff paho.mqtt.client Client",
        b"import paho.mqtt.client as m\nx = m.Client(" + b"(" * 500,
    ],
)
def test_hostile_programs_end_with_a_report(tmp_path, content, capsys):
    (tmp_path / "one.py").write_bytes(content)
    assert command(["learn", str(tmp_path)]) == 2
    assert "Traceback" not in capsys.readouterr().err


def test_the_command_writes_a_system_file_and_checks_it(tmp_path, capsys):
    house = tmp_path / "house"
    house.mkdir()
    (house / "display.py").write_text(PAHO_CLASS)
    assert command(["learn", str(house)]) == 0
    assert "1 client, 2 endpoints" in capsys.readouterr().out
    assert command(["learn", str(house), "--diff"]) == 0
    (house / "display.py").write_text("\n" + PAHO_CLASS)
    assert command(["learn", str(house), "--diff"]) == 0, "a line that moved is no difference"
    (house / "display.py").write_text(PAHO_CLASS.replace("qos=2", "qos=1"))
    capsys.readouterr()
    assert command(["learn", str(house), "--diff"]) == 1
    assert "+       plant/+/temperature: {qos: 1}" in capsys.readouterr().out
    assert command(["check", str(house / "house.clients.yaml")]) in {0, 1}
