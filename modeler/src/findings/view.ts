/** Assigns endpoints, verdicts and findings of a report to elements of the drawing. */

import type { DescribedEndpoint } from '../gen/cqos/v1/check_pb';
import { Role, Severity, Verdict, type Finding, type Group, type Place } from '../gen/cqos/v1/report_pb';
import type { Checked } from '../service/live_check';
import { withoutPremature } from './premature_findings';

/** How an event stands, worst first. `error` concerns the event itself, not a pair; `unmatched` has no partner. */
export const STATES = ['incompatible', 'error', 'unknown', 'unmatched', 'compatible'] as const;
export type State = (typeof STATES)[number];

/** The words for a state. */
export const STATE_WORDS: Readonly<Record<State, string>> = {
  incompatible: 'incompatible',
  error: 'error',
  unknown: 'unknown',
  unmatched: 'no partner',
  compatible: 'compatible',
};

export interface EndpointView {
  readonly endpoint: DescribedEndpoint;
  readonly state: State;
  /** Findings that name it, worst first. */
  readonly findings: readonly Finding[];
  /** Groups with its pairs. */
  readonly groups: readonly Group[];
  /** It stands in the diagram, not in a document beside it. */
  readonly here: boolean;
}

/** Whether all errors among findings are accepted, and there is one: the verdict stays, and does not count. */
export function isAccepted(findings: readonly Finding[]): boolean {
  const errors = findings.filter((finding) => finding.severity === Severity.ERROR);
  return errors.length > 0 && errors.every((finding) => finding.accepted !== undefined);
}

/** An element of the drawing with all its endpoints. */
export interface ElementView {
  readonly element: string;
  readonly state: State;
  readonly endpoints: readonly EndpointView[];
  readonly findings: readonly Finding[];
}

export interface Partner {
  readonly view: EndpointView;
  readonly verdict: Verdict;
  readonly topic: string;
  readonly group: Group;
}

/** A participant of the drawing that findings name. */
export interface ParticipantView {
  readonly element: string;
  readonly findings: readonly Finding[];
}

export interface View {
  readonly checked: Checked;
  /** The name of the diagram among the documents. */
  readonly name: string;
  /** The findings to show: those that are too early while a person draws are left out. */
  readonly findings: readonly Finding[];
  readonly endpoints: ReadonlyMap<string, EndpointView>;
  /** Elements of the drawing that are endpoints, by id. */
  readonly elements: ReadonlyMap<string, ElementView>;
  /** Pools of the drawing that findings name, by id of their element. */
  readonly participants: ReadonlyMap<string, ParticipantView>;
}

/** Return what an answer means for the diagram of this name; `fresh` has the ids of elements that are being drawn. */
export function viewOf(checked: Checked, name: string, fresh: ReadonlySet<string> = new Set()): View {
  const groups = byMember(checked.report.groups, (group) => [...group.publishers, ...group.subscribers]);
  const isFreshAt = (place: Place | undefined): boolean => place?.source === name && fresh.has(place.element ?? '');
  const shown = withoutPremature(checked.report, {
    hasEndpoints: checked.endpoints.size > 0,
    isFresh: ({ members, place }, finding) =>
      members.length === 0
        ? isFreshAt(place ?? finding.place)
        : members.every((id) => !groups.has(id) && isFreshAt(checked.endpoints.get(id)?.place)),
  });
  const findings = byMember(shown, (finding) => finding.sides.flatMap((side) => side.members));
  const endpoints = new Map<string, EndpointView>();
  const byElement = new Map<string, EndpointView[]>();
  for (const endpoint of checked.endpoints.values()) {
    const own = { findings: findings.get(endpoint.id) ?? [], groups: groups.get(endpoint.id) ?? [] };
    const here = endpoint.place?.source === name;
    const view = { endpoint, here, state: stateOf(own.groups, own.findings), ...own };
    endpoints.set(endpoint.id, view);
    const element = endpoint.place?.element;
    if (here && element !== undefined) {
      byElement.set(element, [...(byElement.get(element) ?? []), view]);
    }
  }
  const elements = new Map([...byElement].map(([element, views]) => [element, together(element, views)]));
  return { checked, name, findings: shown, endpoints, elements, participants: participantsOf(checked, name, findings) };
}

function participantsOf(
  checked: Checked,
  name: string,
  findings: ReadonlyMap<string, readonly Finding[]>,
): Map<string, ParticipantView> {
  const result = new Map<string, ParticipantView>();
  for (const { id, place } of checked.participants) {
    const own = findings.get(id);
    if (own && place?.source === name && place.element !== undefined) {
      result.set(place.element, { element: place.element, findings: own });
    }
  }
  return result;
}

function byMember<T>(items: readonly T[], members: (item: T) => readonly string[]): Map<string, T[]> {
  const result = new Map<string, T[]>();
  for (const item of items) {
    for (const member of new Set(members(item))) {
      const list = result.get(member);
      if (list) {
        list.push(item);
      } else {
        result.set(member, [item]);
      }
    }
  }
  return result;
}

function together(element: string, views: readonly EndpointView[]): ElementView {
  const state = STATES.find((each) => views.some((view) => view.state === each)) ?? 'unknown';
  return { element, state, endpoints: views, findings: [...new Set(views.flatMap((view) => view.findings))] };
}

function stateOf(groups: readonly Group[], findings: readonly Finding[]): State {
  const worst = Math.max(Verdict.UNSPECIFIED, ...groups.map((group) => group.verdict));
  if (worst === Verdict.INCOMPATIBLE) {
    return 'incompatible';
  }
  if (findings.some((finding) => finding.severity === Severity.ERROR && finding.accepted === undefined)) {
    return 'error';
  }
  if (groups.length === 0) {
    return 'unmatched';
  }
  return worst === Verdict.COMPATIBLE ? 'compatible' : 'unknown';
}

/** The state that a verdict of a pair has as words and as icon. */
export function stateOfVerdict(verdict: Verdict): State {
  if (verdict === Verdict.COMPATIBLE) {
    return 'compatible';
  }
  return verdict === Verdict.INCOMPATIBLE ? 'incompatible' : 'unknown';
}

/** Return the partners of endpoints, worst first. */
export function partnersOf(view: View, endpoints: readonly EndpointView[]): Partner[] {
  const result: Partner[] = [];
  for (const { endpoint, groups } of endpoints) {
    for (const group of groups) {
      const others = endpoint.role === Role.PUBLISHER ? group.subscribers : group.publishers;
      for (const id of others) {
        const other = view.endpoints.get(id);
        if (other) {
          result.push({ view: other, verdict: group.verdict, topic: group.topic, group });
        }
      }
    }
  }
  return result.sort((a, b) => b.verdict - a.verdict);
}

/** A name for people: that of the endpoint and that of its participant. */
export function nameOf(view: View, id: string): { readonly label: string; readonly owner: string } {
  const endpoint = view.endpoints.get(id)?.endpoint;
  if (!endpoint) {
    const participant = view.checked.participants.find((each) => each.id === id);
    return { label: participant?.label || id, owner: '' };
  }
  const owner = view.checked.participants.find((each) => each.id === endpoint.participant);
  // The id of an endpoint of another document is made of its participant, role and topic.
  const plain = endpoint.place?.element === undefined ? endpoint.topic : endpoint.id;
  return { label: endpoint.label || plain || endpoint.id, owner: owner?.label || owner?.id || '' };
}

/** The same in one text. */
export function fullName(view: View, id: string): string {
  const { label, owner } = nameOf(view, id);
  return owner ? `${owner}: ${label}` : label;
}
