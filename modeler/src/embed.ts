/** The QoS of a diagram in a page of your own: what the package `cqos-modeler` exports. */

import './style/theme.css';
import './style/qos.css';

import type Modeler from 'bpmn-js/lib/Modeler';

import { semanticXml } from './canvas';
import { decode } from './files/encoding';
import { listeners } from './listeners';
import type { Page } from './page';
import { startQos } from './qos';
import { readQualifiedNames } from './qualified_names';
import type { Catalogue } from './service/catalogue';
import type { Services } from './service/transport';
import type { Companion, Notice, StatusKind, Tab, Workspace } from './workspace';

export { loadCatalogue, moddleExtensions, untilLoaded, type Catalogue } from './service/catalogue';
export { connect, type Services } from './service/transport';
export type { Companion, Notice, Page, StatusKind, Tab };

/** Where a page shows QoS. Each element is filled and kept up to date. */
export interface Places {
  /** Properties of what is selected. */
  readonly panel: HTMLElement;
  /** All findings. */
  readonly problems: HTMLElement;
  /** Publishers and subscribers of each topic. */
  readonly matrix: HTMLElement;
  /** Documents that are checked together with the diagram. */
  readonly beside: HTMLElement;
}

/** Functions by which a page names its diagram and shows what happens. Each may be left out. */
export interface PageCallbacks {
  /** The name of the diagram in findings, usually that of its file. */
  name?(): string;
  /** Show one line about the whole: the verdict, or that the service does not answer. */
  status?(text: string, kind: StatusKind): void;
  /** Show a notice in place of the earlier one of this name; null removes it. */
  notice?(name: string, notice: Notice | null): void;
  /** Show how many findings a part has, or nothing for null. */
  badge?(tab: Tab, count: number | null): void;
  /** Bring a part to the front. */
  show?(tab: Tab): void;
  /** A document that stood beside the diagram is the diagram now, under its own name. */
  swapped?(name: string): void;
}

/** QoS on a page: the parts that others may use, and the documents beside the diagram. */
export interface Embedded {
  readonly page: Page;
  /** Check a document together with the diagram, in place of one of the same name. */
  addCompanion(companion: Companion): void;
  removeCompanion(name: string): void;
  /** End the checks, and close the session. */
  stop(): void;
}

/**
 * Check the diagram of a modeler while it is edited, and show its QoS.
 *
 * The modeler is made with `moddleExtensions(catalogue)`. Import the first diagram after this call.
 */
export function embed(modeler: Modeler, places: Places, services: Services, catalogue: Catalogue, callbacks: PageCallbacks = {}): Embedded {
  readQualifiedNames(modeler.get('moddle'));
  const companions = new Map<string, Companion>();
  const changed = listeners<[cause: 'import' | 'edit']>();
  const besideChanged = listeners<[]>();
  let revision = 0;
  let isSwapping = false;
  let swapped: string | undefined;
  const name = (): string => swapped ?? callbacks.name?.() ?? 'diagram.bpmn';
  const note = (cause: 'import' | 'edit'): void => {
    revision += 1;
    changed.call(cause);
  };
  const workspace: Workspace = {
    modeler,
    regions: {
      ...places,
      status: (text, kind) => callbacks.status?.(text, kind),
      announce: (text, kind) => callbacks.status?.(text, kind),
      notice: (id, notice) => callbacks.notice?.(id, notice),
      badge: (tab, count) => callbacks.badge?.(tab, count),
      show: (tab) => callbacks.show?.(tab),
    },
    document: () => ({
      name: name(),
      revision,
      xml: async () => (await modeler.saveXML({ format: true })).xml ?? '',
      semanticXml: () => semanticXml(modeler),
    }),
    onChanged: changed.add,
    companions: () => [...companions.values()],
    addCompanion(companion) {
      companions.set(companion.name, companion);
      besideChanged.call();
    },
    removeCompanion(id) {
      companions.delete(id);
      besideChanged.call();
    },
    onCompanions: besideChanged.add,
    async swap(id) {
      const companion = companions.get(id);
      if (companion === undefined) {
        return;
      }
      const text = await this.document().xml();
      isSwapping = true;
      try {
        await modeler.importXML(decode(companion.bytes));
      } catch (error) {
        await modeler.importXML(text);
        const why = error instanceof Error ? error.message : String(error);
        callbacks.notice?.('failed', { kind: 'error', closable: true, text: `${id} cannot be opened: ${why}` });
        return;
      } finally {
        isSwapping = false;
      }
      companions.delete(id);
      companions.set(name(), { name: name(), bytes: new TextEncoder().encode(text) });
      swapped = id;
      besideChanged.call();
      callbacks.swapped?.(id);
    },
    onExport: () => () => undefined,
  };
  const page = startQos(workspace, services, catalogue);
  modeler.on('import.done', () => {
    swapped = isSwapping ? swapped : undefined;
    note('import');
  });
  modeler.on<{ trigger: string }>('commandStack.changed', ({ trigger }) => {
    if (trigger !== 'clear') {
      note('edit');
    }
  });
  return {
    page,
    addCompanion: (companion) => workspace.addCompanion(companion),
    removeCompanion: (id) => workspace.removeCompanion(id),
    stop: () => page.live.stop(),
  };
}
