/** Asks the service for the weakest settings that meet all requirements, and writes them as one step. */

import { Code, ConnectError } from '@connectrpc/connect';

import type { Step } from '../drawing/diagram';
import { documentsOf, fixSteps } from '../drawing/fixes';
import { remedyText } from '../findings/finding_text';
import type { View } from '../findings/view';
import type { Plan, PlannedChange } from '../gen/cqos/v1/plan_pb';
import { button, make } from '../layout/dom';
import type { Page } from '../page';
import type { Section } from './settings';

const SILENT = new Set([Code.Unknown, Code.Unavailable, Code.Canceled, Code.DeadlineExceeded]);

/** Make the section; it shows while any subscriber has requirements. */
export function suggestSection(page: Page): Section {
  const shown = make('div', { class: 'suggestion', role: 'status' });
  const ask = button('Suggest settings', () => void suggest(), { title: 'Find the weakest settings that meet all requirements of the model' });
  const element = make('section', { class: 'suggest hint', 'aria-label': 'Suggested settings', hidden: true }, ask, shown);
  const revision = (): number => page.workspace.document().revision;
  let planned = revision();

  async function suggest(): Promise<void> {
    planned = revision();
    ask.disabled = true;
    shown.replaceChildren(make('p', {}, 'Looking for settings…'));
    try {
      const plan = await page.suggest();
      const view = page.view();
      if (plan && view && planned === revision()) {
        shown.replaceChildren(...planElements(page, view, plan));
      } else {
        shown.replaceChildren();
      }
    } catch (error) {
      const refused = ConnectError.from(error);
      const words = SILENT.has(refused.code) ? 'The service gave no answer.' : `The service says: ${refused.rawMessage}.`;
      shown.replaceChildren(make('p', {}, words));
    } finally {
      ask.disabled = false;
    }
  }

  return {
    element,
    fields: [],
    update() {
      const needs = [...(page.view()?.endpoints.values() ?? [])].some((each) => each.endpoint.needs.length > 0);
      element.hidden = !needs;
      if (planned !== revision()) {
        planned = revision();
        shown.replaceChildren();
      }
    },
  };
}

function planElements(page: Page, view: View, plan: Plan): HTMLElement[] {
  const conflicts = plan.conflicts.map((each) =>
    make('div', {}, make('p', {}, 'No settings meet these requirements. Without any one of them, the others can be met:'), list(each.parts)),
  );
  if (plan.changes.length === 0) {
    const words = plan.confirmed ? 'Nothing to suggest: the settings as they are meet all requirements.' : 'No settings were found that a check confirms.';
    return conflicts.length > 0 ? conflicts : [make('p', {}, words)];
  }
  const rows = plan.changes.map((each) =>
    make('li', {}, make('p', {}, changeText(page, view, each)), list([...each.because, ...each.costs], 'fix-notes')),
  );
  const costs = [...plan.costs, ...plan.grown];
  return [make('ul', {}, ...rows), ...(costs.length > 0 ? [list(costs, 'fix-notes')] : []), applier(page, view, plan), ...conflicts];
}

function list(texts: readonly string[], kind?: string): HTMLElement {
  return make('ul', { class: kind }, ...texts.map((each) => make('li', {}, each)));
}

function packFor(page: Page, view: View, change: PlannedChange): ReturnType<Page['catalogue']['pack']> {
  return page.catalogue.pack(view.endpoints.get(change.members[0] ?? '')?.endpoint.protocol ?? '');
}

function changeText(page: Page, view: View, change: PlannedChange): string {
  return remedyText(view, packFor(page, view, change), { policy: change.policy, value: change.new, members: change.members });
}

/** The button that writes all of it; or the documents that have to be edited by hand. */
function applier(page: Page, view: View, plan: Plan): HTMLElement {
  const stepsOf = (change: PlannedChange): Step[] | undefined =>
    fixSteps(page.diagram, page.catalogue.form, packFor(page, view, change), change, view.name);
  const elsewhere = plan.changes.filter((each) => stepsOf(each) === undefined);
  if (elsewhere.length > 0) {
    const others = new Set(elsewhere.flatMap((each) => documentsOf(each)).filter((name) => name !== view.name && name !== ''));
    const words = others.size > 0 ? `Some of it belongs into ${[...others].join(', ')}.` : 'Some of it cannot be written into the drawing.';
    return make('p', {}, words);
  }
  const label = plan.changes.length === 1 ? 'Apply this setting' : `Apply these ${plan.changes.length} settings`;
  return button(
    label,
    () => {
      page.diagram.edit(plan.changes.flatMap((each) => stepsOf(each) ?? []));
      page.workspace.regions.announce('The suggested settings are written. Undo takes them back.', 'info');
    },
    { class: 'primary' },
  );
}
