/** Sections of the panel that state settings: by group, the advanced ones folded. */

import type { Pack } from '../gen/cqos/v1/catalogue_pb';
import { OriginKind, Role, Severity, type Fact, type Finding, type Side } from '../gen/cqos/v1/report_pb';
import type { Setting } from '../drawing/form';
import type { Store } from '../drawing/setting_stores';
import { canonical, spellingOf } from '../drawing/values';
import { fullName, type EndpointView } from '../findings/view';
import { factText, messageOf, originWords } from '../findings/finding_text';
import { make } from '../layout/dom';
import type { Page } from '../page';
import { createField, type Field, type Shown } from './fields';
import { foldElement } from './fold';

/** A part of the panel. */
export interface Section {
  readonly element: HTMLElement;
  /** Show the model and the last answer as they are now. */
  update(): void;
  readonly fields: readonly Field[];
}

/** What a section of settings is about. */
export interface Subject {
  readonly pack: Pack;
  /** Key of the drawing's spelling in the pack. */
  readonly dialect: string;
  readonly store: Store;
  readonly role: Role;
  /** Values in force, by name of the policy. */
  facts(): ReadonlyMap<string, Fact>;
  findings(): readonly Finding[];
  /** Ids in reports that stand for the subject. */
  members(): readonly string[];
}

/** Make the fields of settings under the headings of the pack. */
export function settingsSection(page: Page, subject: Subject, settings: readonly Setting[]): Section {
  const fields = settings.map((setting) => ({ setting, field: fieldOf(page, subject, setting) }));
  const element = make('div', { class: 'settings' });
  const isFolded = fields.some(({ setting }) => !setting.policy.advanced);
  const plain = fields.filter(({ setting }) => !isFolded || !setting.policy.advanced);
  const advanced = fields.filter(({ setting }) => isFolded && setting.policy.advanced);
  element.append(...headed(subject.pack, plain));
  let fold: { element: HTMLElement; count(stated: number): void } | undefined;
  if (advanced.length > 0) {
    fold = foldElement('Advanced', ...headed(subject.pack, advanced));
    element.append(fold.element);
  }
  return {
    element,
    fields: fields.map(({ field }) => field),
    update() {
      const facts = subject.facts();
      const findings = subject.findings();
      for (const { setting, field } of fields) {
        field.show(shown(page, subject, setting, facts.get(setting.policy.name), findings));
      }
      fold?.count(advanced.filter(({ setting }) => subject.store.read(setting.written) !== undefined).length);
    },
  };
}

function headed(pack: Pack, fields: readonly { setting: Setting; field: Field }[]): HTMLElement[] {
  const names = [...new Set([...pack.groups, ...fields.map(({ setting }) => setting.policy.group)])];
  const groups = names
    .map((name) => [name, fields.filter(({ setting }) => setting.policy.group === name)] as const)
    .filter(([, members]) => members.length > 0);
  return groups.map(([name, members]) =>
    make(
      'div',
      { class: 'group', role: 'group', 'aria-label': name || 'Settings' },
      name === '' || groups.length === 1 ? null : make('h3', {}, name),
      ...members.map(({ field }) => field.element),
    ),
  );
}

function fieldOf(page: Page, subject: Subject, setting: Setting): Field {
  const spelling = spellingOf(subject.pack, subject.dialect);
  return createField(setting, spelling, (text) => {
    if (text !== subject.store.read(setting.written)) {
      page.diagram.edit(subject.store.write(setting.written, text));
    }
  });
}

function shown(
  page: Page,
  subject: Subject,
  setting: Setting,
  fact: Fact | undefined,
  findings: readonly Finding[],
): Shown {
  const { policy, written } = setting;
  const { pack } = subject;
  const raw = subject.store.read(written);
  const spelling = spellingOf(pack, subject.dialect);
  const explicit = fact?.originKind === OriginKind.EXPLICIT;
  const text = raw === undefined ? undefined : (canonical(setting, spelling, raw) ?? (explicit ? fact.value : raw));
  const standard = policy.defaultValue ?? policy.defaultByRole[subject.role === Role.PUBLISHER ? 'publisher' : 'subscriber'] ?? '';
  // The description may be older than the drawing: an explicit value that is gone has its default now.
  const described = fact && (raw === undefined ? !isStated(fact) : true) ? fact : undefined;
  return {
    text,
    fallback: described?.value ?? standard,
    origin: described ? originWords(described, pack) : standard === '' ? '' : `default of ${pack.title}`,
    problem: problemOf(page, subject, policy.name, findings),
  };
}

function isStated(fact: Fact): boolean {
  return fact.originKind === OriginKind.EXPLICIT && (fact.place?.path ?? '').startsWith('@');
}

/** The worst finding about a value: what the other side has, or its message. */
function problemOf(page: Page, subject: Subject, policy: string, findings: readonly Finding[]): Shown['problem'] {
  const view = page.view();
  const members = subject.members();
  const isOwn = (side: Side): boolean => side.members.some((member) => members.includes(member));
  const concerns = (finding: Finding): boolean =>
    finding.sides.some((side) => isOwn(side) && side.facts.some((fact) => fact.policy === policy));
  const found = findings.find(
    (finding) => finding.severity !== Severity.NOTE && finding.accepted === undefined && concerns(finding),
  );
  if (!found || !view) {
    return undefined;
  }
  const error = found.severity === Severity.ERROR;
  const isEnd = (side: Side): boolean => side.role === 'publisher' || side.role === 'subscriber';
  const other = found.sides.find((side) => !isOwn(side) && isEnd(side) && side.facts.length === 1 && side.members.length > 0);
  const [fact] = other?.facts ?? [];
  if (!other || !fact) {
    return { message: make('span', {}, ...messageOf(view, found.message)).textContent ?? '', error };
  }
  const { label, value } = factText(subject.pack, fact);
  const verb = other.role === 'publisher' ? 'offers' : 'requests';
  const named = fact.policy === policy ? value : `${label} ${value}`;
  return { message: `${fullName(view, other.members[0] ?? '')} ${verb} ${named}`, error };
}

/** Values in force of the endpoints of an element. */
export function factsOf(endpoints: readonly EndpointView[]): Map<string, Fact> {
  return new Map(endpoints.flatMap(({ endpoint }) => endpoint.settings.map((fact) => [fact.policy, fact] as const)));
}
