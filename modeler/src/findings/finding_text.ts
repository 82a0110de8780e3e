/** Words about findings: their messages with names of people, their severity, their fixes. */

import type { Pack, Policy } from '../gen/cqos/v1/catalogue_pb';
import { OriginKind, RemedyKind, Severity, type Fact, type Finding, type Remedy } from '../gen/cqos/v1/report_pb';
import { valueLabel } from '../drawing/values';
import { make } from '../layout/dom';
import type { SignName } from '../layout/signs';
import { fullName, partnersOf, type EndpointView, type View } from './view';

export const SEVERITIES = [Severity.ERROR, Severity.WARNING, Severity.NOTE] as const;

const SEVERITY_WORDS: Readonly<Record<number, readonly [one: string, many: string, icon: SignName]>> = {
  [Severity.ERROR]: ['error', 'errors', 'incompatible'],
  [Severity.WARNING]: ['warning', 'warnings', 'warning'],
  [Severity.NOTE]: ['note', 'notes', 'note'],
};

export function severityWord(severity: Severity): string {
  return SEVERITY_WORDS[severity]?.[0] ?? 'finding';
}

export function severitySign(severity: Severity): SignName {
  return SEVERITY_WORDS[severity]?.[2] ?? 'note';
}

/** `1 error`, `2 errors`. */
export function counted(count: number, severity: Severity): string {
  const [one, many] = SEVERITY_WORDS[severity] ?? ['finding', 'findings'];
  return `${count} ${count === 1 ? one : many}`;
}

/** A message with names in place of ids, and values as code. */
export function messageOf(view: View, message: string): (Node | string)[] {
  const sentence = message.charAt(0).toUpperCase() + message.slice(1);
  return sentence.split('`').map((piece, index) => {
    if (index % 2 === 0) {
      return piece;
    }
    return view.endpoints.has(piece)
      ? make('span', { class: 'endpoint', title: piece }, fullName(view, piece))
      : make('code', {}, piece);
  });
}

/** The policy of a pack by its name. */
export function policyOf(pack: Pack | undefined, name: string): Policy | undefined {
  return pack?.policies.find((each) => each.name === name);
}

/** `mean_period_at_least`: a name, and how its value is meant. */
const BOUNDED = /^(?<name>.*?)(?:_(?<bound>at_least|at_most))?$/s;

/** A value with its label and its policy: `Reliability: Best effort`. */
export function factText(pack: Pack | undefined, fact: Pick<Fact, 'policy' | 'value'>): { label: string; value: string } {
  const policy = policyOf(pack, fact.policy);
  // Facts that no policy holds, such as the time between two samples, have a name only.
  const { name = '', bound } = BOUNDED.exec(fact.policy)?.groups ?? {};
  const plain = name.replaceAll('_', ' ');
  const value = bound === undefined ? fact.value : `${bound.replace('_', ' ')} ${fact.value}`;
  return { label: policy?.label || plain.charAt(0).toUpperCase() + plain.slice(1), value: policy ? valueLabel(policy, fact.value) : value };
}

/** Where a value comes from, in words. */
export function originWords(fact: Fact, pack: Pack): string {
  switch (fact.originKind) {
    case OriginKind.DEFAULT:
      return `default of ${pack.title}`;
    case OriginKind.PRESET:
      return fact.originName === pack.basePreset ? `default of ${pack.title}` : `from preset ${fact.originName}`;
    case OriginKind.PROFILE:
      return `from profile ${fact.originName}`;
    case OriginKind.EXPLICIT:
      return `${fact.value}, stated in the form of another tool`;
    default:
      return fact.origin;
  }
}

/** What a fix does, for its button. */
export function remedyText(view: View, pack: Pack | undefined, remedy: Pick<Remedy, 'policy' | 'value' | 'members'>): string {
  const { label, value } = factText(pack, remedy);
  const [first, ...more] = remedy.members;
  const who = first === undefined ? '' : fullName(view, first);
  const all = more.length === 0 ? who : `${who} and ${more.length} more`;
  return `Set ${label} to ${value} on ${all}`;
}

/** What else a fix means, one sentence each. */
export function remedyNotes(view: View, finding: Finding, remedy: Remedy): string[] {
  const result: string[] = [];
  if (remedy.kindValue === RemedyKind.NEEDS_CODE) {
    result.push('The program has to keep the stronger promise.');
  }
  if (remedy.weakens) {
    result.push('This promises or demands less than the design.');
  }
  result.push(...remedy.costs.map((each) => `It ${each}.`));
  const others = otherPairs(view, finding, remedy);
  if (others.length === 0) {
    return [...result, 'It changes no other pair.'];
  }
  const names = others.slice(0, 3).join('; ') + (others.length > 3 ? `; and ${others.length - 3} more` : '');
  const effect =
    remedy.mends === undefined || remedy.breaks === undefined
      ? 'Their verdicts may change.'
      : remedy.mends + remedy.breaks === 0n
        ? 'No other verdict changes.'
        : `On this topic it improves ${pairs(remedy.mends)} and worsens ${pairs(remedy.breaks)}.`;
  return [...result, `It also changes ${others.length} other ${others.length === 1 ? 'pair' : 'pairs'}: ${names}. ${effect}`];
}

function pairs(count: bigint): string {
  return count === 0n ? 'no pair' : `${count} ${count === 1n ? 'pair' : 'pairs'}`;
}

/** The pairs of the changed endpoints beside those of the finding, as names. */
function otherPairs(view: View, finding: Finding, remedy: Remedy): string[] {
  const concerned = new Set(finding.sides.flatMap((side) => side.members));
  const members = remedy.members.map((id) => view.endpoints.get(id)).filter((each): each is EndpointView => !!each);
  const others = members.flatMap((member) =>
    partnersOf(view, [member])
      .filter((partner) => !concerned.has(partner.view.endpoint.id))
      .map((partner) => `${fullName(view, member.endpoint.id)} with ${fullName(view, partner.view.endpoint.id)}`),
  );
  return [...new Set(others)];
}
