/** Publishers and subscribers by topic. */

import { Role, Verdict, type Group } from '../gen/cqos/v1/report_pb';
import { STATES, stateOfVerdict, type State, type View } from './view';

export interface TopicView {
  readonly topic: string;
  readonly protocol: string;
  /** Ids of endpoints. */
  readonly publishers: readonly string[];
  readonly subscribers: readonly string[];
  readonly state: State;
  /** The verdict of a pair; undefined if the two do not match. */
  verdict(publisher: string, subscriber: string): Verdict | undefined;
}

interface Collected {
  readonly groups: Group[];
  readonly publishers: Set<string>;
  readonly subscribers: Set<string>;
  protocol: string;
}

/** Return the topics of a system, worst first, then by name. */
export function topicsOf(view: View): TopicView[] {
  const topics = new Map<string, Collected>();
  const topic = (protocol: string, name: string): Collected => {
    const key = `${protocol}\n${name}`;
    const known = topics.get(key) ?? { groups: [], publishers: new Set(), subscribers: new Set(), protocol };
    topics.set(key, known);
    return known;
  };
  for (const group of view.checked.report.groups) {
    const known = topic(group.protocol, group.topic);
    known.groups.push(group);
    group.publishers.forEach((id) => known.publishers.add(id));
    group.subscribers.forEach((id) => known.subscribers.add(id));
  }
  for (const { endpoint, groups } of view.endpoints.values()) {
    if (groups.length === 0 && endpoint.topic !== undefined) {
      const known = topic(endpoint.protocol, endpoint.topic);
      (endpoint.role === Role.PUBLISHER ? known.publishers : known.subscribers).add(endpoint.id);
    }
  }
  const result = [...topics].map(([key, known]) => topicView(key.slice(key.indexOf('\n') + 1), known));
  return result.sort(
    (a, b) => STATES.indexOf(a.state) - STATES.indexOf(b.state) || a.topic.localeCompare(b.topic),
  );
}

function topicView(topic: string, { groups, publishers, subscribers, protocol }: Collected): TopicView {
  const states = groups.map((group) => stateOfVerdict(group.verdict));
  return {
    topic,
    protocol,
    publishers: [...publishers],
    subscribers: [...subscribers],
    state: STATES.find((each) => states.includes(each)) ?? 'unmatched',
    verdict(publisher, subscriber) {
      const found = groups.filter(
        (group) => group.publishers.includes(publisher) && group.subscribers.includes(subscriber),
      );
      return found.length === 0 ? undefined : Math.max(...found.map((group) => group.verdict));
    },
  };
}
