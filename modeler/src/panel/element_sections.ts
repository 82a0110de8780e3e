/** The content of the panel for an event, for a pool, and for the model. */

import {
  DrawnMeaning,
  DrawnOwnerKind,
  PolicyLevel,
  type Pack,
  type WrittenSetting,
} from '../gen/cqos/v1/catalogue_pb';
import { Role, type Finding } from '../gen/cqos/v1/report_pb';
import type { ModdleElement } from '../moddle';
import { is, parts, text, type Shape } from '../drawing/diagram';
import { roleOf, signalDefinitions, signalOf } from '../drawing/events';
import { settingsOf, wordFor } from '../drawing/form';
import { attributeStore, eitherStore, elementStore, type Owner, type Store } from '../drawing/setting_stores';
import type { EndpointView } from '../findings/view';
import type { Page } from '../page';
import { markSection, presetSection, protocolSection, textSection } from './choice_sections';
import { convertSection } from './conversion';
import { elementsSection } from './statement_lists';
import { foldElement } from './fold';
import { copySection } from './copied_settings';
import { factsOf, settingsSection, type Section, type Subject } from './settings';
import { suggestSection } from './suggestions';
import { topicSection } from './topic';
import { unknownAnywhere, unknownSection } from './unknown_settings';
import { verdictSection } from './verdict';

type Maybe = Section | undefined;

/** Sections for a signal event. */
export function eventSections(page: Page, shape: Shape, pack: Pack | undefined): Section[] {
  const owner = { shape, part: shape.businessObject };
  const kind = DrawnOwnerKind.EVENT;
  const role = roleOf(owner.part);
  const views = (): readonly EndpointView[] => page.view()?.elements.get(shape.id)?.endpoints ?? [];
  const definitions = signalDefinitions(owner.part);
  const sections: Maybe[] = [
    ...definitions.map((each) => topicSection(page, shape, each)),
    pack && copySection(page, shape, pack),
    pack && unknownSection(page, shape, pack),
    convertSection(page, shape),
    verdictSection(page, shape.id),
    protocolSection(page, owner, kind, () => views()[0]?.endpoint.protocol ?? ''),
  ];
  if (pack) {
    const { form } = page.catalogue;
    const store = attributeStore(page.diagram, form, owner);
    const isStated = (written: WrittenSetting): boolean => store.read(written) !== undefined;
    const subject = subjectOf(page, pack, role, store, views);
    sections.push(presetSection(page, shape, pack));
    sections.push(settingsSection(page, subject, settingsOf(pack, form, PolicyLevel.ENDPOINT, { role, isStated })));
    sections.push(needsSection(page, pack, role, owner, views));
    sections.push(suggestSection(page));
    sections.push(topicFacts(page, pack, role, shape, definitions.map(signalOf)));
  }
  const more: Maybe[] = [
    textSection(page, owner, kind, DrawnMeaning.TYPE, 'Data type'),
    markSection(page, owner, kind, DrawnMeaning.EXTERNAL, 'The partner is outside of this system'),
  ];
  sections.push(foldedSection('Type and partner', more.filter(isSection)));
  sections.push(elementsSection(page, owner, kind, DrawnMeaning.EXCEPTION, 'Exceptions'));
  return sections.filter(isSection);
}

/** Sections for a pool, or for a process that no pool shows. */
export function poolSections(page: Page, owner: Owner, pack: Pack | undefined): Section[] {
  const kind = DrawnOwnerKind.PARTICIPANT;
  const found = (): string => page.view()?.checked.participants.find((each) => each.place?.element === owner.shape.id)?.protocol ?? '';
  const sections: Maybe[] = [verdictSection(page, owner.shape.id), protocolSection(page, owner, kind, found), unknownAnywhere(page)];
  if (pack) {
    const { form } = page.catalogue;
    const subject = subjectOf(page, pack, Role.UNSPECIFIED, attributeStore(page.diagram, form, owner), () => []);
    const settings = settingsSection(page, subject, settingsOf(pack, form, PolicyLevel.PARTICIPANT));
    sections.push(settings.fields.length > 0 ? foldedSection('Connection', [settings]) : undefined);
    sections.push(optionsSection(page, pack, owner, kind));
  }
  sections.push(markSection(page, owner, kind, DrawnMeaning.EXTERNAL, 'The partners of this pool are outside of this system'));
  return sections.filter(isSection);
}

/** Sections for the whole model. */
export function modelSections(page: Page, pack: Pack | undefined): Section[] {
  const owner = { shape: page.diagram.canvas.getRootElement(), part: page.diagram.definitions() };
  const kind = DrawnOwnerKind.MODEL;
  const protocol = (): string => [...(page.view()?.endpoints.values() ?? [])].find((each) => each.here)?.endpoint.protocol ?? '';
  const sections: Maybe[] = [convertSection(page), protocolSection(page, owner, kind, protocol), unknownAnywhere(page)];
  if (pack) {
    sections.push(optionsSection(page, pack, owner, kind));
  }
  sections.push(elementsSection(page, owner, kind, DrawnMeaning.EXCEPTION, 'Exceptions'));
  sections.push(elementsSection(page, owner, kind, DrawnMeaning.TEAM_RULE, 'Rules of the team'));
  return sections.filter(isSection);
}

function isSection(section: Maybe): section is Section {
  return section !== undefined;
}

function subjectOf(page: Page, pack: Pack, role: Role, store: Store, views: () => readonly EndpointView[]): Subject {
  return {
    pack,
    role,
    store,
    dialect: page.catalogue.form.dialect,
    facts: () => factsOf(views()),
    findings: () => views().flatMap((each) => each.findings) as readonly Finding[],
    members: () => views().map((each) => each.endpoint.id),
  };
}

/** Requirements of the application, as child elements. */
function needsSection(page: Page, pack: Pack, role: Role, owner: Owner, views: () => readonly EndpointView[]): Maybe {
  const { form } = page.catalogue;
  const word = wordFor(form, DrawnOwnerKind.EVENT, DrawnMeaning.REQUIREMENT);
  const settings = settingsOf(pack, form, PolicyLevel.NEED, { role });
  if (!word || settings.length === 0) {
    return undefined;
  }
  const store = elementStore(page.diagram, form, owner, word, { key: 'name', value: 'value' });
  const section = settingsSection(page, subjectOf(page, pack, role, store, views), settings);
  return foldedSection('Requirements', [section], () => settings.filter((each) => store.read(each.written) !== undefined).length);
}

/** Facts about the topics of an event, as attributes of their signals. */
function topicFacts(page: Page, pack: Pack, role: Role, shape: Shape, signals: readonly (ModdleElement | undefined)[]): Maybe {
  const { form } = page.catalogue;
  const settings = settingsOf(pack, form, PolicyLevel.TOPIC);
  const sections = signals
    .filter((signal): signal is ModdleElement => signal !== undefined)
    .map((part) => {
      const store = attributeStore(page.diagram, form, { shape, part });
      return settingsSection(page, subjectOf(page, pack, role, store, () => []), settings);
    });
  return settings.length === 0 || sections.length === 0 ? undefined : foldedSection('About the topic', sections);
}

/** Options of the deployment, as attributes or as child elements. */
function optionsSection(page: Page, pack: Pack, owner: Owner, kind: DrawnOwnerKind): Maybe {
  const { form } = page.catalogue;
  const word = wordFor(form, kind, DrawnMeaning.OPTION);
  const settings = settingsOf(pack, form, PolicyLevel.OPTION);
  if (!word || settings.length === 0) {
    return undefined;
  }
  const attribute = word.attributes.find((each) => each.name === 'protocol');
  const fixed = kind === DrawnOwnerKind.MODEL && attribute ? { [attribute.name]: pack.id } : {};
  const elements = elementStore(page.diagram, form, owner, word, { key: 'name', value: 'value', fixed });
  const asAttributes = form.owners.some((each) => each.kind === kind && each.levels.includes(PolicyLevel.OPTION));
  const store = asAttributes ? eitherStore(attributeStore(page.diagram, form, owner), elements) : elements;
  const section = settingsSection(page, subjectOf(page, pack, Role.UNSPECIFIED, store, () => []), settings);
  return foldedSection('Deployment', [section], () => settings.filter((each) => store.read(each.written) !== undefined).length);
}

/** Sections in one fold. */
function foldedSection(title: string, sections: readonly Section[], stated: () => number = () => 0): Section {
  const { element, count } = foldElement(title, ...sections.map((each) => each.element));
  return {
    element,
    fields: sections.flatMap((each) => each.fields),
    update() {
      sections.forEach((each) => each.update());
      count(stated());
    },
  };
}

/** What an element is, in words, and its name. */
export function titleOf(page: Page, shape: Shape): { readonly kind: string; readonly name: string } {
  const part = shape.businessObject;
  if (shape === page.diagram.canvas.getRootElement() && !is(part, 'bpmn:SubProcess')) {
    return { kind: 'Model', name: page.workspace.document().name };
  }
  const name = text(part, 'name');
  if (signalDefinitions(part).length > 0) {
    return { kind: roleOf(part) === Role.PUBLISHER ? 'Publisher' : 'Subscriber', name };
  }
  if (is(part, 'bpmn:Participant')) {
    return { kind: 'Pool', name };
  }
  const words = part.$type.replace(/^bpmn:/, '').replace(/([a-z])([A-Z])/g, '$1 $2').toLowerCase();
  const more = parts(part, 'eventDefinitions').length > 0 ? ' without a signal' : '';
  return { kind: words.charAt(0).toUpperCase() + words.slice(1) + more, name };
}
