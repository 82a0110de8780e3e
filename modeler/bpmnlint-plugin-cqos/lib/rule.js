const { findingsOf } = require('./findings');

/**
 * Make the rule that reports findings of one severity.
 *
 * Its configuration: `service`, the address of `cqos serve --web` (else the variable CQOS_SERVICE, else
 * http://127.0.0.1:8080); `protocol` of events that state none; `only` and `ignore`, lists of codes.
 */
module.exports = (severity) => (config = {}) => ({
  check(node, reporter) {
    if (node.$type !== 'bpmn:Definitions') return;
    const elements = identities(node);
    let findings;
    try {
      findings = findingsOf(node, config);
    } catch (error) {
      // bpmnlint counts an error of a rule as a warning, so a model that was not checked would pass.
      reporter.report(node.id, `not checked: ${error.message}`);
      return;
    }
    for (const finding of findings) {
      if (finding.severity !== severity || finding.accepted !== undefined || !isWanted(finding, config)) continue;
      for (const { id, path } of placesOf(finding, elements, node)) {
        reporter.report(id, `${finding.message} (${finding.code})`, path);
      }
    }
  },
});

const isWanted = ({ code }, { only, ignore = [] }) => (only === undefined || only.includes(code)) && !ignore.includes(code);

/** Return each element that a finding concerns, with the property where the value stands; the whole model if it is none. */
function placesOf(finding, elements, definitions) {
  const found = new Map();
  for (const side of finding.sides ?? []) {
    const place = side.place ?? {};
    for (const member of side.members ?? []) {
      // An event with several signals, or in a process of several pools, is several endpoints: `event#2`, `event@pool`.
      const id = [member, member.replace(/[#@][^#@]*$/, '')].find((each) => elements.has(each));
      if (id !== undefined) found.set(id, id === place.element ? pathOf(place) : undefined);
    }
  }
  const own = finding.place ?? {};
  if (found.size === 0 && elements.has(own.element)) found.set(own.element, pathOf(own));
  if (found.size === 0) found.set(definitions.id, undefined);
  return [...found].map(([id, path]) => ({ id, path }));
}

const pathOf = ({ path = '' }) => (path.startsWith('@') ? [path.slice(1)] : undefined);

function identities(definitions) {
  const found = new Set();
  const waiting = [definitions];
  while (waiting.length > 0) {
    const element = waiting.pop();
    if (found.has(element.id)) continue;
    if (element.id !== undefined) found.add(element.id);
    for (const { name, isReference } of element.$descriptor?.properties ?? []) {
      const value = isReference ? undefined : element[name.split(':').pop()];
      if (value && typeof value === 'object') waiting.push(...[value].flat().filter((each) => each?.$type));
    }
  }
  return found;
}
