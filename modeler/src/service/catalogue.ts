/** The rule packs of the service, and what a drawing can state. */
import { Code, ConnectError } from '@connectrpc/connect';

import type { DrawnForm, Pack, PackSummary } from '../gen/cqos/v1/catalogue_pb';
import { failure } from './failures';
import type { Services } from './transport';

export interface Catalogue {
  /** Installed rule packs, by id. */
  readonly packs: readonly PackSummary[];
  /** What a BPMN drawing can state, and where. */
  readonly form: DrawnForm;
  /** The pack, if it is installed and has been loaded; else loads it and calls `onLoaded` listeners later. */
  pack(id: string): Pack | undefined;
  /** Whether a pack of this id is installed. */
  has(id: string): boolean;
  /** The number of packs that have been loaded. */
  loaded(): number;
  onLoaded(listener: () => void): void;
}

/** Return the moddle extensions with which bpmn-js reads and writes what a drawing can state. */
export function moddleExtensions({ form }: Catalogue): Readonly<Record<string, object>> {
  return { [form.prefix]: JSON.parse(form.moddle) as object };
}

const RETRY = 1000;

/** Load the catalogue, again and again while the service does not answer; `waiting` gets the reason. */
export async function untilLoaded(services: Services, waiting: (reason: string) => void): Promise<Catalogue> {
  for (;;) {
    try {
      return await loadCatalogue(services);
    } catch (error) {
      const why = failure(error);
      if (why.kind === 'refused') {
        throw error;
      }
      waiting((why.kind === 'away' && why.message) || 'it does not answer');
      await new Promise((resolve) => setTimeout(resolve, RETRY));
    }
  }
}

/** Load the list of packs and the drawn form whose dialect is `dialect`. Throws a ConnectError without the service. */
export async function loadCatalogue(services: Services, dialect = 'bpmn'): Promise<Catalogue> {
  const list = await services.catalogue.listPacks({});
  const form = list.importers.map((each) => each.drawn).find((drawn) => drawn?.dialect === dialect);
  if (!form) {
    throw new ConnectError(`the service describes no drawings of the form ${dialect}`, Code.Unimplemented);
  }
  const loaded = new Map<string, Pack>();
  const asked = new Set<string>();
  const listeners: (() => void)[] = [];
  const ids = new Set(list.packs.map((each) => each.id));

  function load(id: string): void {
    if (asked.has(id) || !ids.has(id)) {
      return;
    }
    asked.add(id);
    services.catalogue.getPack({ id }).then(
      ({ pack }) => {
        if (pack) {
          loaded.set(id, pack);
          listeners.forEach((listener) => listener());
        }
      },
      // The next call asks again: the service may be away.
      () => asked.delete(id),
    );
  }

  return {
    packs: list.packs,
    form,
    pack(id) {
      load(id);
      return loaded.get(id);
    },
    has: (id) => ids.has(id),
    loaded: () => loaded.size,
    onLoaded: (listener) => void listeners.push(listener),
  };
}
