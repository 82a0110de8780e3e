/** Topics whose names differ by a typing error from that of an event without partner. */

import type { EndpointView, View } from './view';

/** In a shorter name, one letter makes another word. */
const LENGTH = 5;

/** Return names of topics, as written, on which an endpoint would have a partner. */
export function similarTopics(view: View, { endpoint }: EndpointView): string[] {
  const { topicWritten: own, protocol, role } = endpoint;
  const others = [...view.endpoints.values()].map((each) => each.endpoint);
  const names = new Set(others.filter((each) => each.role !== role && each.protocol === protocol).map((each) => each.topicWritten));
  return [...names].filter((name) => name !== own && own.length >= LENGTH && isSlip(own.toLowerCase(), name.toLowerCase()));
}

/** Whether one letter was added, left out or changed, or two neighbours changed places; digits are meant as they are. */
function isSlip(one: string, other: string): boolean {
  const least = Math.min(one.length, other.length);
  let start = 0;
  while (start < least && one[start] === other[start]) {
    start += 1;
  }
  let end = 0;
  while (end < least - start && one.at(-1 - end) === other.at(-1 - end)) {
    end += 1;
  }
  const [mine, theirs] = [one, other].map((each) => each.slice(start, each.length - end)) as [string, string];
  const isSwapped = mine.length === 2 && mine === [...theirs].reverse().join('');
  return (isSwapped || Math.max(mine.length, theirs.length) <= 1) && !/\d/.test(mine + theirs);
}
