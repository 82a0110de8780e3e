/** Verdicts at the shapes of the diagram. They are never part of the model. */

import type { Shape } from '../drawing/diagram';
import { Severity, type Finding } from '../gen/cqos/v1/report_pb';
import { make } from '../layout/dom';
import { sign, type SignName } from '../layout/signs';
import type { Page } from '../page';
import { STATE_WORDS, isAccepted, type ElementView, type State, type View } from './view';
import { counted } from './finding_text';

const ICONS: Readonly<Record<State, SignName>> = {
  incompatible: 'incompatible',
  error: 'warning',
  unknown: 'unknown',
  unmatched: 'unmatched',
  compatible: 'compatible',
};

export function stateSign(state: State): SignName {
  return ICONS[state];
}

interface Mark {
  readonly state: State | 'warning';
  readonly words: string;
  readonly more: string;
  /** It stands inside a pool, not above an event. */
  readonly inside: boolean;
}

interface Drawn {
  readonly key: string;
  readonly mark: Mark;
  readonly overlay: string;
  readonly html: HTMLElement;
}

/** Badges are never smaller than this part of their size. */
const LEAST_SCALE = 0.8;
/** The width of the longest badge. */
const WORDS = 102;
/** Badges whose tops differ by less are beside each other. */
const ROW = 20;

/** Keep markers and badges of the diagram equal to views. */
export interface Markers {
  show(view: View): void;
  /** Grey while what they show may be old. */
  stale(isStale: boolean): void;
}

export function createMarkers(page: Page): Markers {
  const { diagram } = page;
  const drawn = new Map<string, Drawn>();
  diagram.modeler.on('diagram.clear', () => drawn.clear());
  // An element that comes back by undo has lost its badge.
  diagram.modeler.on('shape.removed', (event: { readonly element: { readonly id: string } }) => {
    drawn.delete(event.element.id);
  });

  function remove(id: string): void {
    const old = drawn.get(id);
    if (old) {
      drawn.delete(id);
      diagram.canvas.removeMarker(id, markerOf(old.mark));
      diagram.overlays.remove(old.overlay);
    }
  }

  function add(id: string, mark: Mark, key: string): void {
    const html = make('div');
    dressBadge(html, mark);
    diagram.canvas.addMarker(id, markerOf(mark));
    const middle = (diagram.registry.get(id)?.width ?? 0) / 2;
    const overlay = diagram.overlays.add(id, 'qos-verdict', {
      position: mark.inside ? { top: 6, left: 36 } : { top: -6, left: middle },
      scale: { min: LEAST_SCALE },
      html: mark.inside ? html : make('div', { class: 'qos-anchor' }, html),
    });
    drawn.set(id, { key, mark, overlay, html });
  }

  /** Change a badge where it is: a new overlay lays out the whole page. */
  function change(id: string, old: Drawn, mark: Mark, key: string): void {
    diagram.canvas.removeMarker(id, markerOf(old.mark));
    diagram.canvas.addMarker(id, markerOf(mark));
    dressBadge(old.html, mark);
    drawn.set(id, { ...old, key, mark });
  }

  let room = Infinity;

  /** Show signs alone where words would lie over each other. */
  function fitWords(): void {
    const zoom = diagram.canvas.zoom();
    diagram.canvas.getContainer().classList.toggle('qos-signs-only', room * zoom < WORDS * Math.max(zoom, LEAST_SCALE));
  }

  diagram.modeler.on('canvas.viewbox.changed', fitWords);

  return {
    stale(isStale) {
      diagram.canvas.getContainer().classList.toggle('qos-stale', isStale);
      const { panel, problems, matrix } = page.workspace.regions;
      [panel, problems, matrix].forEach((each) => each.classList.toggle('stale', isStale));
    },
    show(view) {
      const wanted = marksOf(view);
      for (const id of [...drawn.keys()]) {
        if (!wanted.has(id)) {
          remove(id);
        }
      }
      for (const [id, mark] of wanted) {
        const key = JSON.stringify(mark);
        const shape = diagram.registry.get(id);
        const old = drawn.get(id);
        if (shape && old?.key !== key) {
          if (old?.mark.inside === mark.inside) {
            change(id, old, mark, key);
          } else {
            remove(id);
            add(id, mark, key);
          }
        }
      }
      room = leastGap([...wanted].flatMap(([id, { inside }]) => (inside ? [] : (diagram.registry.get(id) ?? []))));
      fitWords();
    },
  };
}

/** The least distance between neighbours in a row. */
function leastGap(shapes: readonly Shape[]): number {
  const ends = shapes.map(({ x = 0, y = 0, width }) => ({ x: x + width / 2, row: Math.round(y / ROW) }));
  ends.sort((one, other) => one.row - other.row || one.x - other.x);
  return ends.slice(1).reduce((least, { x, row }, at) => {
    const before = ends[at];
    return before?.row === row ? Math.min(least, x - before.x) : least;
  }, Infinity);
}

function markerOf({ state }: Mark): string {
  return `qos-${state}`;
}

function dressBadge(html: HTMLElement, { state, words, more }: Mark): void {
  html.className = `qos-badge qos-badge-${state}`;
  html.title = more;
  html.replaceChildren(sign(state === 'warning' ? 'warning' : ICONS[state]), make('span', {}, words));
}

/** The marks of a view, by id of the element. */
export function marksOf(view: View): Map<string, Mark> {
  const result = new Map<string, Mark>();
  for (const { element, findings } of view.participants.values()) {
    const grave = findings.filter((each) => each.severity !== Severity.NOTE && each.accepted === undefined);
    if (grave.length > 0) {
      const state = grave.some((each) => each.severity === Severity.ERROR) ? 'error' : 'warning';
      const more = grave.map((each) => each.message).join('\n');
      result.set(element, { state, words: countWords(grave), more, inside: true });
    }
  }
  for (const each of view.elements.values()) {
    result.set(each.element, markOf(each));
  }
  return result;
}

function markOf({ state, findings }: ElementView): Mark {
  const grave = findings.filter((each) => each.severity !== Severity.NOTE && each.accepted === undefined);
  const words = STATE_WORDS[state] + (isAccepted(findings) ? ', accepted' : '');
  const more = [words, countWords(grave)].filter((each) => each !== '').join(', ');
  return { state, words, more, inside: false };
}

function countWords(findings: readonly Finding[]): string {
  return [Severity.ERROR, Severity.WARNING]
    .map((severity) => [findings.filter((each) => each.severity === severity).length, severity] as const)
    .filter(([count]) => count > 0)
    .map(([count, severity]) => counted(count, severity))
    .join(', ');
}
