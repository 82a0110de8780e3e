/** Offers the settings of another event of the topic to an event that states none. */

import { DrawnMeaning, DrawnOwnerKind, PolicyLevel, type Pack } from '../gen/cqos/v1/catalogue_pb';
import { text, type Shape, type Step } from '../drawing/diagram';
import { poolOf, processOf, roleOf, signalDefinitions, signalOf } from '../drawing/events';
import { foreignOf } from '../drawing/foreign_settings';
import { attributeFor, settingsOf, type Setting } from '../drawing/form';
import { attributeStore, type Store } from '../drawing/setting_stores';
import { button, make } from '../layout/dom';
import type { Page } from '../page';
import { packOf } from './conversion';
import { factsOf, type Section } from './settings';

/** Make the section, which is there only while the event states nothing. */
export function copySection(page: Page, shape: Shape, pack: Pack): Section {
  const element = make('div', { class: 'convert', hidden: true });
  let shown = '';
  return {
    element,
    fields: [],
    update() {
      const facts = [...factsOf(page.view()?.elements.get(shape.id)?.endpoints ?? []).values()];
      const isStated = stepsFrom(page, shape, shape, pack).length > 0 || foreignOf(shape, page.catalogue.form, pack, facts) !== undefined;
      const other = isStated ? undefined : sourceOf(page, shape, pack);
      const steps = other ? stepsFrom(page, other, shape, pack) : [];
      const words = other ? `${nameOf(page, other)} has this topic, too, and states ${steps.length === 1 ? 'a setting' : `${steps.length} settings`}.` : '';
      element.hidden = steps.length === 0;
      if (words !== shown) {
        shown = words;
        element.replaceChildren(make('p', {}, words), button(`Use ${steps.length === 1 ? 'it' : 'them'} here, too`, () => copy(page, shape, pack)));
      }
    },
  };
}

function copy(page: Page, shape: Shape, pack: Pack): void {
  const other = sourceOf(page, shape, pack);
  if (other) {
    page.diagram.edit(stepsFrom(page, other, shape, pack));
  }
}

/** Return an event of the same topic and protocol with settings that count here; one at the other end first. */
function sourceOf(page: Page, shape: Shape, pack: Pack): Shape | undefined {
  const topics = topicsOf(shape);
  const others = page.diagram.registry.filter(
    (each) => each !== shape && !each.labelTarget && topicsOf(each).some((topic) => topics.includes(topic)) && packOf(page, each) === pack,
  );
  const stating = others.filter((each) => stepsFrom(page, each, shape, pack).length > 0);
  return stating.find((each) => roleOf(each.businessObject) !== roleOf(shape.businessObject)) ?? stating[0];
}

function topicsOf(shape: Shape): string[] {
  const signals = signalDefinitions(shape.businessObject).map(signalOf);
  return signals.flatMap((each) => (each ? [text(each, 'name').trim()] : [])).filter((name) => name !== '');
}

/** Steps that state at one event what another states, as far as it counts there. */
function stepsFrom(page: Page, from: Shape, to: Shape, pack: Pack): Step[] {
  const { form } = page.catalogue;
  const store = (shape: Shape): Store => attributeStore(page.diagram, form, { shape, part: shape.businessObject });
  const settings: Setting[] = settingsOf(pack, form, PolicyLevel.ENDPOINT, { role: roleOf(to.businessObject) });
  const steps = settings.flatMap(({ written }) => {
    const value = store(from).read(written);
    return value === undefined ? [] : store(to).write(written, value);
  });
  const preset = attributeFor(form, DrawnOwnerKind.EVENT, DrawnMeaning.PRESET);
  const stated = preset === undefined ? '' : text(from.businessObject, preset);
  return preset === undefined || stated === '' ? steps : [page.diagram.update(to, { [preset]: stated }), ...steps];
}

function nameOf(page: Page, { businessObject }: Shape): string {
  const pool = poolOf(page.diagram, processOf(businessObject));
  return [pool ? text(pool, 'name') : '', text(businessObject, 'name')].filter((each) => each !== '').join(': ') || 'Another event';
}
