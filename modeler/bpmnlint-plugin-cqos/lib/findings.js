const { spawnSync } = require('node:child_process');
const { Writer } = require('moddle-xml');

const SEVERITIES = { SEVERITY_ERROR: 'error', SEVERITY_WARNING: 'warning', SEVERITY_NOTE: 'note' };
const MOST_BYTES = 1 << 28;

// The rules of one run look at the same model, which is checked once.
const known = new WeakMap();

/**
 * Return the findings of C-QoS on a model, as the service's JSON has them, with short words for severities.
 *
 * Throws an Error if the service does not answer or refuses the model.
 */
exports.findingsOf = (definitions, { service, protocol }) => {
  const address = (service ?? process.env.CQOS_SERVICE ?? 'http://127.0.0.1:8080').replace(/\/+$/, '');
  const key = JSON.stringify([address, protocol]);
  const answers = known.get(definitions) ?? new Map();
  known.set(definitions, answers);
  if (!answers.has(key)) answers.set(key, attempt(() => ask(address, definitions, protocol)));
  const { value, error } = answers.get(key);
  if (error) throw error;
  return value;
};

function attempt(call) {
  try {
    return { value: call() };
  } catch (error) {
    return { error };
  }
}

function ask(address, definitions, protocol) {
  const content = Buffer.from(new Writer({ preamble: true }).toXML(definitions)).toString('base64');
  const request = {
    documents: [{ name: 'model.bpmn', content }],
    reading: { importer: 'bpmn', ...(protocol && { protocol }) },
    fields: ['code', 'severity', 'message', 'accepted', 'place', 'sides'].map((name) => `findings.${name}`).join(','),
  };
  // Rules of bpmnlint have no promises, so a process of its own makes the call.
  const url = `${address}/cqos.v1.CheckService/CheckDocument`;
  const call = spawnSync(process.execPath, [require.resolve('./request'), url], {
    input: JSON.stringify(request),
    encoding: 'utf8',
    maxBuffer: MOST_BYTES,
  });
  if (call.error || call.status !== 0) {
    throw new Error(`C-QoS at ${address}: ${call.error?.message ?? call.stderr.trim()}`);
  }
  const findings = JSON.parse(call.stdout).report?.findings ?? [];
  return findings.map((finding) => ({ ...finding, severity: SEVERITIES[finding.severity] }));
}
