// A modeler's calls: node modeler.js [ADDRESS], the address of a running `cqos serve`.
import { create } from "@bufbuild/protobuf";
import { Code, ConnectError, createClient } from "@connectrpc/connect";
import { createGrpcTransport } from "@connectrpc/connect-node";

import { CatalogueService } from "./gen/cqos/v1/catalogue_pb.js";
import { CheckService } from "./gen/cqos/v1/check_pb.js";
import { Role, Severity, Verdict } from "./gen/cqos/v1/report_pb.js";
import { EditRequestSchema, SessionService } from "./gen/cqos/v1/session_pb.js";

const transport = createGrpcTransport({ baseUrl: `http://${process.argv[2] ?? "127.0.0.1:50051"}` });
const catalogue = createClient(CatalogueService, transport);
const checks = createClient(CheckService, transport);
const sessions = createClient(SessionService, transport);

// 1. A property panel for a protocol that this program does not know.

const FIELDS = { choice: "select", flag: "checkbox", count: "number", duration: "text", names: "text", text: "text" };

function panel(pack, role) {
  return pack.policies
    .filter((policy) => policy.level === "endpoint" && policy.roles.includes(role))
    .map((policy) => ({
      label: policy.name,
      field: FIELDS[policy.kind],
      options: [...policy.values, ...policy.words],
      placeholder: policy.defaultValue ?? policy.defaultByRole[role] ?? policy.expected,
      help: policy.doc,
    }));
}

const { pack } = await catalogue.getPack({ id: "ros2" });
console.log(`panel of a ${pack.title} subscriber:`);
for (const row of panel(pack, "subscriber").slice(0, 4)) {
  console.log(`  ${row.label}: ${row.field} [${row.options.join(", ")}], ${row.placeholder}`);
}

// 2. The model with the modeler's own ids, checked after each change.

function endpoint(id, role, participant, settings) {
  return { id, role, topic: "weather", participant, settings };
}

const model = {
  protocol: "ros2",
  participants: [{ id: "Participant_Drone" }, { id: "Participant_Station" }],
  endpoints: [
    endpoint("Event_Throw", Role.PUBLISHER, "Participant_Station", { reliability: "best_effort" }),
    endpoint("Event_Catch", Role.SUBSCRIBER, "Participant_Drone", { reliability: "reliable" }),
  ],
};

let revision = 0n;

async function check() {
  revision += 1n;
  const answer = await checks.checkSystem({ revision, system: model });
  return answer.revision === revision ? answer.report : undefined; // drops an answer to an older model
}

const report = await check();
console.log(`\nverdict: ${Verdict[report.verdict]}`);
for (const finding of report.findings.filter((each) => each.severity === Severity.ERROR)) {
  const marked = finding.sides.flatMap((side) => side.members);
  console.log(`mark ${marked.join(" and ")}: ${finding.code} ${finding.message}`);
  for (const remedy of finding.remedies) {
    console.log(`  offer to set ${remedy.policy} of ${remedy.members} to ${remedy.value} (${remedy.kind})`);
  }
}

// 3. The first fix, in a session that stays open: the answer contains the changes.

const [{ remedies }] = report.findings;
const waiting = [{ revision: 1n, edit: { case: "open", value: model } }];
let wake = () => {};

async function* edits() {
  for (;;) {
    while (waiting.length > 0) yield create(EditRequestSchema, waiting.shift());
    await new Promise((resolve) => (wake = resolve));
    if (waiting.length === 0) return;
  }
}

console.log();
for await (const answer of sessions.edit(edits())) {
  if (answer.revision === 1n) {
    const changed = model.endpoints.find((each) => each.id === remedies[0].members[0]);
    changed.settings[remedies[0].policy] = remedies[0].value;
    const change = { change: { case: "putEndpoint", value: changed } };
    waiting.push({ revision: 2n, edit: { case: "changes", value: { changes: [change] } } });
    wake();
  } else {
    const { verdict } = answer.outcome.case === "delta" ? answer.outcome.value.summary : answer.outcome.value;
    console.log(`after the edit: ${Verdict[verdict]} (answered by a ${answer.outcome.case})`);
    wake();
  }
}

// 4. The errors of a wrong request, field by field.

try {
  await checks.checkPair({ protocol: "telegraph" });
} catch (error) {
  const refused = ConnectError.from(error);
  console.log(`\na wrong request: ${Code[refused.code]}: ${refused.rawMessage}`);
}
