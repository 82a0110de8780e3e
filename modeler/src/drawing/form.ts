/** Names of attributes and elements that state something in a drawing, from the catalogue. */

import { create } from '@bufbuild/protobuf';

import {
  DrawnMeaning,
  PolicyLevel,
  WrittenSettingSchema,
  type DrawnForm,
  type DrawnOwnerKind,
  type DrawnWord,
  type Pack,
  type Policy,
  type WrittenSetting,
} from '../gen/cqos/v1/catalogue_pb';
import type { Role } from '../gen/cqos/v1/report_pb';

/** A policy, and how a drawing states it. */
export interface Setting {
  readonly policy: Policy;
  readonly written: WrittenSetting;
}

/** In lower case without separators, as names of settings are compared. */
export function normalised(name: string): string {
  return name.toLowerCase().replaceAll(/[-_\s]/g, '');
}

/** Whether a name in a file is one of those of a setting. */
export function states({ spellings }: WrittenSetting, name: string): boolean {
  const wanted = normalised(name);
  return spellings.some((each) => normalised(each) === wanted);
}

/** The word with a meaning that an owner can have, in the form that C-QoS writes. */
export function wordFor(form: DrawnForm, owner: DrawnOwnerKind, meaning: DrawnMeaning): DrawnWord | undefined {
  const known = form.owners.find((each) => each.kind === owner);
  return known?.words.find((word) => word.meaning === meaning && !word.foreign);
}

/** The attribute with a meaning, with its prefix. */
export function attributeFor(form: DrawnForm, owner: DrawnOwnerKind, meaning: DrawnMeaning): string | undefined {
  const word = wordFor(form, owner, meaning);
  return word && !word.element ? `${form.prefix}:${word.name}` : undefined;
}

/** Local names of the attributes of an owner that are no settings. */
export function attributeNames(form: DrawnForm, owner: DrawnOwnerKind): readonly string[] {
  const known = form.owners.find((each) => each.kind === owner);
  return (known?.words ?? []).filter((word) => !word.element).map((word) => word.name);
}

/** Local names of the child elements that other tools write for the settings of an owner. */
export function foreignElements(form: DrawnForm, owner: DrawnOwnerKind): readonly string[] {
  const known = form.owners.find((each) => each.kind === owner);
  return (known?.words ?? [])
    .filter((word) => word.foreign && word.element && word.meaning === DrawnMeaning.SETTINGS)
    .map((word) => word.name);
}

/** A requirement is stated by the first alias of its policy, in an element of its own. */
function asNeed({ name, aliases, words }: Policy): WrittenSetting {
  return create(WrittenSettingSchema, { policy: name, name: aliases[0] ?? name, words, spellings: [name, ...aliases] });
}

/** Whether a setting has an effect at endpoints of a role. */
function counts(policy: Policy, written: WrittenSetting, role: Role | undefined): boolean {
  if (role === undefined) {
    return true;
  }
  const roles = written.roles.length > 0 ? written.roles : policy.roleValues;
  return roles.length === 0 || roles.includes(role);
}

/** Limits settings to those of a role, and to others that are stated all the same. */
export interface Ends {
  readonly role?: Role;
  isStated?(written: WrittenSetting): boolean;
}

/** The settings of a level that a drawing can state, in the order of display. */
export function settingsOf(pack: Pack, form: DrawnForm, level: PolicyLevel, ends: Ends = {}): Setting[] {
  const writes = pack.dialects[form.dialect]?.writes ?? [];
  const result: Setting[] = [];
  for (const policy of pack.policies) {
    const written = level === PolicyLevel.NEED ? asNeed(policy) : writes.find((each) => each.level === level && each.policy === policy.name);
    if (policy.levelValue === level && written && !policy.derived && (counts(policy, written, ends.role) || ends.isStated?.(written))) {
      result.push({ policy, written });
    }
  }
  return result;
}
