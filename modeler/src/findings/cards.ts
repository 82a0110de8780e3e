/** One finding in full: both sides, the reason, its fixes, and the way to accept it. */

import { text } from '../drawing/diagram';
import { fixSteps, documentsOf } from '../drawing/fixes';
import { OriginKind, Severity, type Finding, type Place, type Remedy, type Side } from '../gen/cqos/v1/report_pb';
import { button, make } from '../layout/dom';
import { sign } from '../layout/signs';
import type { Page } from '../page';
import { acceptForm } from './accept';
import { fullName, type View } from './view';
import { factText, messageOf, originWords, remedyNotes, remedyText, severitySign, severityWord } from './finding_text';

/** The finding in one line: severity, message, code. `short` says only what it is about. */
export function summary(page: Page, view: View, finding: Finding, short = false): HTMLElement[] {
  const severity = make('span', { class: `severity severity-${severityWord(finding.severity)}` });
  severity.append(sign(severitySign(finding.severity)), make('span', { class: 'only-read' }, `${severityWord(finding.severity)}: `));
  return [
    severity,
    make('span', { class: 'message' }, ...((short ? shortTitle(page, finding) : undefined) ?? messageOf(view, finding.message))),
    make('span', { class: 'code' }, finding.code),
  ];
}

/** The names of the policies that it compares, if they say what it is about. */
function shortTitle(page: Page, finding: Finding): [string] | undefined {
  const pack = page.catalogue.pack(finding.source);
  const facts = finding.sides.flatMap((side) => side.facts);
  const labels = [...new Set(facts.map((fact) => factText(pack, fact).label))];
  const [first = '', ...others] = labels;
  const words = [first, ...others.map((each) => each.charAt(0).toLowerCase() + each.slice(1))];
  return words.length < 4 && first !== '' ? [words.join(', ').replace(/, ([^,]*)$/, ' and $1')] : undefined;
}

/** The details of a finding: both sides, the fixes, the reasons. `folds` puts the reasons into a fold. */
export function details(page: Page, view: View, finding: Finding, folds = false): HTMLElement {
  const element = make('div', { class: 'finding-details' });
  const sides = finding.sides.filter((side) => side.facts.length > 0 || side.members.length > 0);
  if (sides.length > 0) {
    element.append(make('div', { class: 'sides' }, ...ordered(sides).map((side) => sideElement(page, view, finding, side))));
  }
  if (finding.remedies.length > 0) {
    element.append(make('div', { class: 'fixes' }, ...finding.remedies.map((remedy) => fix(page, view, finding, remedy))));
  }
  const reasons = reasonList(view, finding);
  const accept = finding.severity !== Severity.NOTE && finding.accepted === undefined ? [acceptForm(page, view, finding)] : [];
  if (folds) {
    element.append(make('details', { class: 'why' }, make('summary', {}, 'Why'), reasons, ...accept));
  } else {
    element.append(reasons, ...accept);
  }
  return element;
}

function reasonList(view: View, finding: Finding): HTMLElement {
  const list = make('dl', { class: 'reasons' });
  const reasons: [string, string][] = [
    ['Why', finding.because],
    ['Source', finding.clause],
    ['Advice', finding.help ?? ''],
    ['Accepted', finding.accepted ?? ''],
    ...finding.notes.map((note): [string, string] => ['Note', note]),
  ];
  for (const [name, words] of reasons) {
    if (words !== '') {
      list.append(make('dt', {}, name), make('dd', {}, ...messageOf(view, words)));
    }
  }
  return list;
}

/** Publishers first: offered stands left of requested. */
function ordered(sides: readonly Side[]): Side[] {
  return [...sides].sort((a, b) => Number(b.role === 'publisher') - Number(a.role === 'publisher'));
}

function sideElement(page: Page, view: View, finding: Finding, side: Side): HTMLElement {
  const pack = page.catalogue.pack(finding.source);
  const element = make('div', { class: 'side' }, make('p', { class: 'side-label' }, sideLabel(side)));
  for (const fact of side.facts) {
    const { label, value } = factText(pack, fact);
    const words = make('span', { class: 'fact-value' }, value);
    element.append(make('p', { class: 'fact' }, make('span', { class: 'fact-label' }, label), words));
    if (fact.origin !== 'explicit') {
      const origin = pack && fact.originKind !== OriginKind.EXPLICIT ? originWords(fact, pack) : fact.origin;
      element.append(make('p', { class: 'fact-origin' }, origin));
    }
  }
  for (const id of side.members.slice(0, 5)) {
    element.append(memberLink(page, view, id, { policy: side.facts[0]?.policy, place: side.place }));
  }
  if (side.members.length > 5) {
    element.append(make('p', { class: 'fact-origin' }, `and ${side.members.length - 5} more`));
  }
  return element;
}

function sideLabel(side: Side): string {
  const word = side.label.replace(/ here$/, '') || side.role;
  return word.charAt(0).toUpperCase() + word.slice(1);
}

/** What a finding says of a member: the policy that it is about, and the place of others than endpoints and pools, such as timers. */
interface About {
  readonly policy?: string | undefined;
  readonly place?: Place | undefined;
}

/** A button that jumps to an element of the diagram; a name for others. */
export function memberLink(page: Page, view: View, id: string, { policy, place: other }: About = {}): HTMLElement {
  const known = view.endpoints.get(id)?.endpoint ?? view.checked.participants.find((each) => each.id === id);
  const drawn = known ? undefined : page.diagram.registry.get(id)?.businessObject;
  const place = known ? known.place : other;
  const name = (drawn && text(drawn, 'name')) || fullName(view, id);
  const isHere = place?.source === view.name;
  const element = isHere ? place.element : undefined;
  if (element === undefined || page.diagram.registry.get(element) === undefined) {
    const where = isHere ? 'not drawn' : place?.source;
    return make('p', { class: 'elsewhere', title: where || undefined }, where ? `${name} (${where})` : name);
  }
  return button(name, () => page.reveal(element, policy), { class: 'link' });
}

function fix(page: Page, view: View, finding: Finding, remedy: Remedy): HTMLElement {
  const pack = page.catalogue.pack(finding.source);
  const steps = fixSteps(page.diagram, page.catalogue.form, pack, remedy, view.name);
  const words = remedyText(view, pack, remedy);
  const notes = remedyNotes(view, finding, remedy);
  if (!steps) {
    const where = documentsOf(remedy).filter((name) => name !== view.name && name !== '');
    notes.push(where.length > 0 ? `Edit ${where.join(', ')} to apply it.` : 'This fix cannot be written into the drawing.');
    return make('div', { class: 'fix' }, make('p', { class: 'fix-text' }, words), make('p', { class: 'fix-notes' }, notes.join(' ')));
  }
  const note = make('p', { class: 'fix-notes' }, notes.join(' '));
  const apply = button(words, () => {
    const fresh = fixSteps(page.diagram, page.catalogue.form, pack, remedy, view.name);
    if (fresh) {
      page.diagram.edit(fresh);
      page.workspace.regions.announce(`${words}. Undo takes it back.`, 'info');
    }
  }, { class: remedy === finding.remedies.find((each) => !each.weakens) ? 'fix-button primary' : 'fix-button' });
  return make('div', { class: 'fix' }, apply, note);
}
