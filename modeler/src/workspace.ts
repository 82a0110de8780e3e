/** What the parts of the page share: the diagram, the regions of the page, and the documents beside the diagram. */

import type Modeler from 'bpmn-js/lib/Modeler';

import type { Place } from './files/place';

/** How a line of the status bar is meant; `busy` shows until the next one. */
export type StatusKind = 'info' | 'ok' | 'warning' | 'error' | 'busy';

/** The bottom tabs. */
export type Tab = 'problems' | 'matrix' | 'beside';

/** A notice above the canvas. */
export interface Notice {
  readonly text: string;
  readonly kind: 'info' | 'warning' | 'error';
  readonly actions?: readonly { readonly label: string; run(): void }[];
  /** Without it the notice has no button that closes it. */
  readonly closable?: boolean;
}

/** Where the parts of the page draw. Each part owns the content of its element. */
export interface Regions {
  /** Right of the canvas: properties of what is selected. */
  readonly panel: HTMLElement;
  /** Bottom tabs. */
  readonly problems: HTMLElement;
  readonly matrix: HTMLElement;
  readonly beside: HTMLElement;
  /** Show one line at the lower edge of the page. Screen readers read it. */
  status(text: string, kind: StatusKind): void;
  /** Show a line in its place for some seconds, or until the next one. */
  announce(text: string, kind: StatusKind): void;
  /** Show a notice above the canvas in place of the earlier one of this name; null removes it. */
  notice(name: string, notice: Notice | null): void;
  /** Show a number at a bottom tab, or none. */
  badge(tab: Tab, count: number | null): void;
  /** Bring a bottom tab to the front. */
  show(tab: Tab): void;
}

/** The diagram that is drawn. */
export interface DrawnDocument {
  /** The name of its file, or of the file that it would be saved as. */
  readonly name: string;
  /** Changes with every command, import, undo and redo. */
  readonly revision: number;
  /** The text that `save` writes: the original text where nothing was edited. */
  xml(): Promise<string>;
  /** The model without diagram interchange, in one form for equal models: a moved shape does not change it. */
  semanticXml(): Promise<string>;
}

/** A document that is checked together with the diagram. */
export interface Companion {
  readonly name: string;
  readonly bytes: Uint8Array;
  /** Where a save writes it once it is the diagram; a download without one. */
  readonly place?: Place | null;
  readonly handle?: FileSystemFileHandle | null;
}

/** Ends a subscription. */
export type Stop = () => void;

/** What the shell gives to the panel, the findings and the documents beside the diagram. */
export interface Workspace {
  readonly modeler: Modeler;
  readonly regions: Regions;
  document(): DrawnDocument;
  /** Call back after an import (`import`) and after every command, undo and redo (`edit`), also those that only move shapes. */
  onChanged(listener: (cause: 'import' | 'edit') => void): Stop;
  /** The documents beside the diagram, in the order in which they were opened; names are unique. */
  companions(): readonly Companion[];
  /** Put a document beside the diagram, in place of one of the same name. */
  addCompanion(companion: Companion): void;
  removeCompanion(name: string): void;
  onCompanions(listener: () => void): Stop;
  /** Open one of the companions as the diagram; the file of the diagram becomes a companion. */
  swap(name: string): Promise<void>;
  /** Say how markers look in an exported SVG: called with a copy of the drawing, before it is written. */
  onExport(listener: (svg: SVGSVGElement) => void): Stop;
}
