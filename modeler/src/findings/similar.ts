/** Topics whose names differ from that of a lonely event by a typing error. */

import type { EndpointView, View } from './view';

/** The most letters that are added, left out or changed, and the least length of a name in which that is a slip. */
const SLIP = 2;
const LENGTH = 5;

/** Return names of topics, as written, on which an endpoint would have a partner; the nearest first. */
export function similarTopics(view: View, { endpoint }: EndpointView): string[] {
  const { topicWritten: own, protocol, role } = endpoint;
  if (own.length < LENGTH) {
    return [];
  }
  const others = [...view.endpoints.values()].map((each) => each.endpoint);
  const names = new Set(others.filter((each) => each.role !== role && each.protocol === protocol).map((each) => each.topicWritten));
  return [...names]
    .map((name) => [name, distance(own.toLowerCase(), name.toLowerCase())] as const)
    .filter(([name, letters]) => name !== own && letters <= SLIP)
    .sort((a, b) => a[1] - b[1] || a[0].localeCompare(b[0]))
    .map(([name]) => name);
}

/** How many letters have to be added, left out or changed; more than `SLIP` where the lengths say so already. */
function distance(one: string, other: string): number {
  if (Math.abs(one.length - other.length) > SLIP) {
    return SLIP + 1;
  }
  let row = Array.from({ length: other.length + 1 }, (_, at) => at);
  for (const [index, letter] of [...one].entries()) {
    const next = [index + 1];
    for (let at = 0; at < other.length; at += 1) {
      const changed = (row[at] ?? 0) + (letter === other[at] ? 0 : 1);
      next.push(Math.min(changed, (row[at + 1] ?? 0) + 1, (next[at] ?? 0) + 1));
    }
    row = next;
  }
  return row[other.length] ?? SLIP + 1;
}
