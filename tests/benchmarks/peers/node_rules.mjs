// The paper's single rule on node-rules 9: processor time of judging pairs of a publisher and a subscriber, in microseconds.
import { RuleEngine } from "node-rules";
import { readFileSync } from "node:fs";

const { pairs, ranks } = JSON.parse(readFileSync(0, "utf8"));
const weaker = (offered, requested, policy) => ranks[offered[policy]] < ranks[requested[policy]];
const later = (offered, requested, policy) => offered[policy] > requested[policy];

const engine = new RuleEngine();
engine.register({
  condition(R, { pub, sub }) {
    R.when(
      ["reliability", "durability", "liveliness"].some((policy) => weaker(pub, sub, policy)) ||
        ["deadline", "lease_duration"].some((policy) => later(pub, sub, policy)),
    );
  },
  consequence(R, fact) {
    fact.result = false;
    R.stop();
  },
});
const judged = (pair) => new Promise((done) => engine.execute(pair, (fact) => done(fact.result !== false)));

for (const pair of pairs) await judged(pair);
const before = process.cpuUsage();
let compatible = 0;
for (const pair of pairs) compatible += await judged(pair);
const { user, system } = process.cpuUsage(before);
console.log(JSON.stringify({ microseconds: user + system, compatible }));
