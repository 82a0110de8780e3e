/** The way of a line from one shape to another: past other shapes where there is one. */

export interface Box {
  readonly x: number;
  readonly y: number;
  readonly width: number;
  readonly height: number;
}

export type Point = readonly [x: number, y: number];

/** Where a line starts: at a side of its shape, below an event at the edge of another shape, or as a message between pools. */
export type Start = 'side' | 'edge' | 'message';

const BEND = 25;
const ROW = 40;
/** Lines below and above a row of shapes, so that not all are one. */
const LANES = [14, 22, 30] as const;

/** Return the points of the line that crosses the fewest shapes; of equal ones, the simplest. `number` chooses its lane. */
export function route(from: Box, to: Box, start: Start, shapes: readonly Box[], number: number): readonly Point[] {
  if (start === 'message') {
    return message(from, to);
  }
  const lane = LANES[number % LANES.length] ?? LANES[0];
  const ways = from === to ? [loop(from, lane)] : start === 'edge' ? fromEdge(from, to, lane) : fromSide(from, to, lane);
  const crossed = ways.map((way) => shapes.filter((box) => crosses(way, box)).length);
  return ways[crossed.indexOf(Math.min(...crossed))] ?? [];
}

function message(from: Box, to: Box): readonly Point[] {
  const isDown = to.y > from.y;
  const [start, end] = isDown ? [from.y + from.height, to.y] : [from.y, to.y + to.height];
  return [[middle(from), start], [middle(from), (start + end) / 2], [middle(to), (start + end) / 2], [middle(to), end]];
}

function loop(box: Box, lane: number): readonly Point[] {
  const [right, below] = [box.x + box.width, box.y + box.height];
  return [[right, half(box)], [right + BEND, half(box)], [right + BEND, below + lane], [middle(box), below + lane], [middle(box), below]];
}

/** From the right side of a shape; back to an earlier one, from below or from above. */
function fromSide(from: Box, to: Box, lane: number): readonly (readonly Point[])[] {
  const [right, y, end] = [from.x + from.width, half(from), half(to)];
  const below = Math.max(lower(from), lower(to)) + lane;
  const above = Math.min(upper(from), upper(to)) - lane;
  const under = lower(from) + lane;
  const around: (readonly Point[])[] = [
    [[middle(from), from.y + from.height], [middle(from), below], [middle(to), below], [middle(to), to.y + to.height]],
    [[middle(from), from.y], [middle(from), above], [middle(to), above], [middle(to), to.y]],
    [[middle(from), from.y + from.height], [middle(from), under], [to.x - BEND, under], [to.x - BEND, end], [to.x, end]],
  ];
  if (to.x < right) {
    return around;
  }
  const late = to.x - BEND;
  const ahead: (readonly Point[])[] = [late, right + BEND].map((bend) => [[right, y], [bend, y], [bend, end], [to.x, end]]);
  return [...(y === end ? [[[right, y], [to.x, end]] as const] : ahead), ...around];
}

/** Down from an event at an edge, so that the line leaves the shape. */
function fromEdge(from: Box, to: Box, lane: number): readonly (readonly Point[])[] {
  const out = from.y + from.height;
  const below = Math.max(out, lower(to)) + lane;
  return [
    [[middle(from), out], [middle(from), out + lane], [to.x - BEND, out + lane], [to.x - BEND, half(to)], [to.x, half(to)]],
    [[middle(from), out], [middle(from), below], [middle(to), below], [middle(to), to.y + to.height]],
  ];
}

/** The edges of the row in which a shape stands: others in it are as high as a task. */
function upper(box: Box): number {
  return half(box) - Math.max(box.height / 2, ROW);
}

function lower(box: Box): number {
  return half(box) + Math.max(box.height / 2, ROW);
}

function middle(box: Box): number {
  return box.x + box.width / 2;
}

function half(box: Box): number {
  return box.y + box.height / 2;
}

/** Whether a line runs through the inside of a box; it may touch the edge. */
function crosses(way: readonly Point[], box: Box): boolean {
  return way.slice(1).some(([x, y], at) => {
    const [before, above] = way[at] ?? [x, y];
    const [left, right, top, bottom] = [Math.min(before, x), Math.max(before, x), Math.min(above, y), Math.max(above, y)];
    return left < box.x + box.width - 1 && right > box.x + 1 && top < box.y + box.height - 1 && bottom > box.y + 1;
  });
}
