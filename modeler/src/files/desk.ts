/** What a person does with files: new, open, save, drop, recent, and what the page does so that no work is lost. */

import { ask } from '../layout/dialog';
import type { Companion, Regions } from '../workspace';
import { type Diagram, type Imported, NOWHERE, type Source } from './diagram';
import { isEqual } from './encoding';
import { chooseFiles, chooseTarget, type Chosen, download, droppedFiles, fromHandle } from './picker';
import { ChangedOnDisk, handlePlace, type Place } from './place';
import { isAllowed, type Recent, recentFiles, remember } from './recent';
import { undrawnWords } from './pools';
import * as recovery from './recovery';

const BPMN = 'http://www.omg.org/spec/BPMN/20100524/MODEL';
const KEEP_AFTER = 800;
const LOOK_EVERY = 2000;

/** What the desk works on. */
export interface Desktop {
  readonly diagram: Diagram;
  readonly regions: Regions;
  readonly named: readonly Place[];
  addCompanion(companion: Companion): void;
  /** The name or the state of the diagram changed. */
  shown(): void;
}

export class Desk {
  private readonly tab = recovery.thisTab();
  private keeping: ReturnType<typeof setTimeout> | undefined;
  private isLooking = false;
  private kept = -1;

  constructor(private readonly desktop: Desktop) {}

  async newDiagram(): Promise<void> {
    if ((await this.mayLeave()) && (await this.show(NOWHERE))) {
      await this.forgetUnsaved();
    }
  }

  async open(): Promise<void> {
    await this.openChosen(await chooseFiles());
  }

  async openRecent({ name, handle, bytes }: Recent): Promise<void> {
    if (handle === null) {
      await this.openBytes(name, bytes ?? new Uint8Array());
    } else if (await isAllowed(handle)) {
      await this.openChosen([await fromHandle(handle)]);
    }
  }

  /** Whether the browser keeps the changes as they are now. */
  get isKept(): boolean {
    return this.kept === this.desktop.diagram.revision;
  }

  get named(): readonly Place[] {
    return this.desktop.named;
  }

  async recent(): Promise<Recent[]> {
    return recentFiles();
  }

  /** Open a document that stood beside the diagram; return the file of the diagram that gave way, or null where the person or the document says no. */
  async openCompanion({ name, bytes, place = null, handle = null }: Companion): Promise<readonly Companion[] | null> {
    if (!(await this.mayLeave())) {
      return null;
    }
    const left = this.desktop.diagram.source; // without changes that a person discards
    const content = await place?.read().catch(() => null); // it may be gone: then what was read of it is shown, and a save asks where to
    const source = place !== null && content ? fromPlace(place, content, handle) : { ...NOWHERE, name, bytes: new Uint8Array(bytes) };
    if (!(await this.show(source))) {
      return null;
    }
    await this.forgetUnsaved();
    return left.bytes === null || left.bytes.length === 0 ? [] : [{ name: left.name, bytes: left.bytes, place: left.place, handle: left.handle }];
  }

  async openBytes(name: string, bytes: Uint8Array<ArrayBuffer>): Promise<void> {
    await this.openChosen([{ name, bytes, place: null, handle: null, tag: null }]);
  }

  private async show(source: Source): Promise<boolean> {
    try {
      this.note(source, await this.desktop.diagram.open(source));
    } catch (error) {
      this.failed(`${source.name} cannot be opened`, error);
      return false;
    }
    this.desktop.shown();
    return true;
  }

  /** Say what a person should know of a document that was opened. */
  private note({ name }: Source, { warnings, rebound, isLaidOut, undrawn }: Imported): void {
    const { regions } = this.desktop;
    for (const each of ['import', 'disk', 'rebound', 'layout', 'undrawn']) {
      regions.notice(each, null);
    }
    if (rebound !== null) {
      const text = `In ${name} the QoS prefix was bound to ${rebound}. It is bound to the right namespace now; save to keep that.`;
      regions.notice('rebound', { kind: 'info', closable: true, text });
    }
    if (isLaidOut) {
      const text = `${name} has no drawing, so its elements were placed here. Save to keep their places.`;
      regions.notice('layout', { kind: 'info', closable: true, text });
    }
    const text = undrawnWords(undrawn);
    if (text !== '') {
      const actions = undrawn.processes.length > 0 ? [{ label: 'Draw each process as a pool', run: () => void this.drawPools() }] : [];
      regions.notice('undrawn', { kind: 'warning', closable: true, text, actions });
    }
    if (warnings.length > 0) {
      const text = `${name} was opened with ${warnings.length} ${warnings.length === 1 ? 'warning' : 'warnings'}: ${warnings[0]}`;
      regions.notice('import', { kind: 'warning', closable: true, text });
    }
  }

  private async drawPools(): Promise<void> {
    const { diagram, regions } = this.desktop;
    if (await this.show({ ...diagram.source, unsaved: await diagram.pooled() })) {
      regions.announce('Each process has a pool. Save to keep that.', 'info');
      this.edited();
    }
  }

  private failed(what: string, error: unknown): void {
    const why = error instanceof Error ? error.message : String(error);
    this.desktop.regions.notice('failed', { kind: 'error', closable: true, text: `${what}: ${why}` });
    this.desktop.regions.announce(what, 'error');
  }

  async mayLeave(): Promise<boolean> {
    this.desktop.regions.notice('failed', null);
    if (!this.desktop.diagram.isEdited) {
      return true;
    }
    const answer = await ask(`Save ${this.desktop.diagram.source.name}?`, 'It has changes that are in no file.', [
      { id: 'save', label: 'Save' },
      { id: 'discard', label: 'Discard changes' },
      { id: 'stay', label: 'Cancel' },
    ]);
    if (answer === 'save') {
      await this.save();
      return !this.desktop.diagram.isEdited;
    }
    return answer === 'discard';
  }

  async openChosen(chosen: readonly Chosen[]): Promise<void> {
    const drawn = chosen.find(({ bytes }) => isDiagram(bytes));
    for (const each of chosen) {
      if (each !== drawn) {
        this.desktop.addCompanion(each);
        this.desktop.regions.show('beside');
      }
    }
    if (drawn === undefined || !(await this.mayLeave())) {
      return;
    }
    if (await this.show(drawn)) {
      await this.forgetUnsaved();
      await remember(drawn.name, drawn.handle, drawn.bytes);
      this.desktop.regions.announce(`Opened ${drawn.name}`, 'ok');
    }
  }

  async openNamed(place: Place): Promise<void> {
    if (await this.mayLeave()) {
      const content = await place.read();
      if (await this.show(fromPlace(place, content))) {
        await this.forgetUnsaved();
        this.desktop.regions.announce(content === null ? `${place.name} is new` : `Opened ${place.name}`, 'ok');
      }
    }
  }

  async save(): Promise<void> {
    const { source } = this.desktop.diagram;
    if (source.place === null) {
      await this.saveAs();
      return;
    }
    await this.into(source.place, source.handle, source.tag);
  }

  private async into(place: Place, handle: FileSystemFileHandle | null, replaces: string | null): Promise<void> {
    const bytes = await this.desktop.diagram.bytes();
    try {
      const tag = await place.write(bytes, replaces);
      await this.desktop.diagram.saved({ name: place.name, bytes, place, handle, tag });
    } catch (error) {
      if (error instanceof ChangedOnDisk) {
        this.onDisk(place);
      } else {
        this.failed(`${place.name} was not saved`, error);
      }
      return;
    }
    await this.afterSave(place.name, handle, bytes);
  }

  private async afterSave(name: string, handle: FileSystemFileHandle | null, bytes: Uint8Array<ArrayBuffer>): Promise<void> {
    if (!this.desktop.diagram.isEdited) {
      await this.forgetUnsaved();
    }
    this.desktop.regions.notice('disk', null);
    this.desktop.regions.announce(`Saved ${name}`, 'ok');
    this.desktop.shown();
    await remember(name, handle, bytes);
  }

  async saveAs(): Promise<void> {
    const { name, place } = this.desktop.diagram.source;
    const target = await chooseTarget(name);
    if (target !== null && target !== 'download') {
      await this.into(handlePlace(target, `handle ${target.name} ${Date.now()}`), target, null);
    } else if (target === 'download') {
      const bytes = await this.desktop.diagram.bytes();
      download(name, bytes, 'application/xml');
      if (place === null) {
        await this.desktop.diagram.saved({ name, bytes, place, handle: null, tag: null });
        await this.afterSave(name, null, bytes);
      }
      this.desktop.regions.announce(`Downloaded ${place === null ? '' : 'a copy of '}${name}`, 'ok');
    }
  }

  /** Say that a file is another one now, and what can be done. */
  private onDisk(place: Place): void {
    const actions = [{ label: 'Open the version on disk', run: () => void this.openAnyway(place) }];
    if (this.desktop.diagram.isEdited) {
      actions.push({ label: 'Save a copy…', run: () => void this.copy() });
    }
    const edited = this.desktop.diagram.isEdited ? ' Your changes here are not saved, and will not overwrite it.' : '';
    this.desktop.regions.notice('disk', { kind: 'warning', text: `${place.name} changed on disk.${edited}`, actions });
  }

  private async openAnyway(place: Place): Promise<void> {
    if (await this.mayDiscard()) {
      await this.show(fromPlace(place, await place.read(), this.desktop.diagram.source.handle));
      await this.forgetUnsaved();
    }
  }

  private async mayDiscard(): Promise<boolean> {
    const answers = [
      { id: 'discard', label: 'Discard my changes' },
      { id: 'stay', label: 'Cancel' },
    ] as const;
    return !this.desktop.diagram.isEdited || (await ask('Discard your changes?', 'The version on disk has none of them.', answers)) === 'discard';
  }

  private async copy(): Promise<void> {
    const target = await chooseTarget(this.desktop.diagram.source.name.replace(/(\.[^.]*)?$/, '-copy$1'));
    if (target === 'download') {
      const bytes = await this.desktop.diagram.bytes();
      download(this.desktop.diagram.source.name.replace(/(\.[^.]*)?$/, '-copy$1'), bytes, 'application/xml');
    } else if (target !== null) {
      await this.into(handlePlace(target, `handle ${target.name} ${Date.now()}`), target, null);
    }
  }

  /** Look whether another program wrote the file. */
  private async look(): Promise<void> {
    const { source } = this.desktop.diagram;
    if (this.isLooking || document.hidden || source.place === null || source.tag === null) {
      return;
    }
    this.isLooking = true;
    try {
      const content = await source.place.read(source.tag);
      const isOther = content !== null && source.bytes !== null && !isEqual(content.bytes, source.bytes);
      if (isOther && this.desktop.diagram.source === source) {
        this.onDisk(source.place);
      }
    } catch {
      // The service or the file is away for a moment. A save says why it fails.
    } finally {
      this.isLooking = false;
    }
  }

  /** Take note of a command: the changes are kept in the browser a moment later. */
  edited(): void {
    this.desktop.shown();
    clearTimeout(this.keeping);
    this.keeping = setTimeout(() => void this.keep(), KEEP_AFTER);
  }

  private async keep(): Promise<void> {
    clearTimeout(this.keeping);
    if (!this.desktop.diagram.isEdited) {
      await recovery.forget(this.tab);
      return;
    }
    const { source, revision } = this.desktop.diagram;
    const { name, bytes, place, handle, tag } = source;
    const text = await this.desktop.diagram.draft();
    const time = Date.now();
    await recovery.keep({ tab: this.tab, name, text, original: bytes, place: place?.id ?? null, handle, tag, time });
    this.kept = revision;
    this.desktop.shown();
  }

  private async forgetUnsaved(): Promise<void> {
    clearTimeout(this.keeping);
    await recovery.forget(this.tab);
  }

  private async recover(unsaved: recovery.Unsaved): Promise<void> {
    const named = this.desktop.named.find(({ id }) => id === unsaved.place) ?? null;
    const place = named ?? (unsaved.handle === null ? null : handlePlace(unsaved.handle, unsaved.place ?? ''));
    const { name, original, handle, tag, text } = unsaved;
    if (await this.show({ name, bytes: original, place, handle, tag, unsaved: text })) {
      this.desktop.regions.announce(`Recovered ${name}`, 'ok');
      if (unsaved.tab !== this.tab) {
        await this.keep();
        await recovery.forget(unsaved.tab);
      }
    }
  }

  private offer(unsaved: recovery.Unsaved): void {
    const name = `recover ${unsaved.tab}`;
    const when = new Date(unsaved.time).toLocaleString();
    const done = (): void => this.desktop.regions.notice(name, null);
    this.desktop.regions.notice(name, {
      kind: 'info',
      text: `Unsaved changes of ${unsaved.name} were kept (${when}).`,
      actions: [
        { label: 'Recover', run: () => void this.mayLeave().then((may) => (may ? (done(), this.recover(unsaved)) : undefined)) },
        { label: 'Discard', run: () => void recovery.forget(unsaved.tab).then(done) },
      ],
    });
  }

  async start(): Promise<void> {
    const { own, others } = await recovery.leftBehind(this.tab).catch(() => ({ own: null, others: [] }));
    recovery.showAlive(this.tab);
    if (own !== null) {
      await this.recover(own);
      const discard = { label: 'Discard them', run: () => void this.discardRecovered() };
      const text = `Unsaved changes of ${own.name} were recovered.`;
      this.desktop.regions.notice('recovered', { kind: 'info', closable: true, text, actions: [discard] });
    }
    others.forEach((each) => this.offer(each));
    const opened = await Promise.all(this.desktop.named.map(async (place) => ({ place, content: await place.read() })));
    const first = opened.find(({ content }) => content === null || isDiagram(content.bytes));
    const isTried = own === null && first !== undefined;
    const isShown = isTried && (await this.show(fromPlace(first.place, first.content)));
    if (own === null && !isShown) {
      await this.show(NOWHERE);
    }
    for (const { place, content } of opened) {
      const isRefused = isTried && !isShown && place === first.place; // a notice says why
      if (content !== null && !isRefused && place.id !== this.desktop.diagram.source.place?.id) {
        this.desktop.addCompanion({ name: place.name, bytes: content.bytes, place });
      }
    }
    this.listen();
  }

  private async discardRecovered(): Promise<void> {
    const { place } = this.desktop.diagram.source;
    this.desktop.regions.notice('recovered', null);
    await this.forgetUnsaved();
    await this.show(place === null ? NOWHERE : fromPlace(place, await place.read(), this.desktop.diagram.source.handle));
  }

  private listen(): void {
    setInterval(() => void this.look(), LOOK_EVERY);
    addEventListener('focus', () => void this.look());
    addEventListener('beforeunload', (event) => {
      if (this.desktop.diagram.isEdited) {
        void this.keep();
        event.preventDefault();
      }
    });
    addEventListener('dragover', (event) => {
      if (event.dataTransfer?.types.includes('Files') === true) {
        document.documentElement.dataset['dropping'] = '';
        event.preventDefault();
      }
    });
    addEventListener('dragleave', (event) => {
      if (event.relatedTarget === null) {
        delete document.documentElement.dataset['dropping'];
      }
    });
    addEventListener('drop', (event) => {
      delete document.documentElement.dataset['dropping'];
      if (event.dataTransfer !== null && event.dataTransfer.types.includes('Files')) {
        event.preventDefault();
        void droppedFiles(event.dataTransfer).then((chosen) => this.openChosen(chosen));
      }
    });
  }
}

function fromPlace(place: Place, content: { bytes: Uint8Array<ArrayBuffer>; tag: string } | null, handle: FileSystemFileHandle | null = null): Source {
  return { name: place.name, bytes: content?.bytes ?? null, place, handle, tag: content?.tag ?? null };
}

/** Whether a file is a BPMN diagram, and not a document of another kind. */
function isDiagram(bytes: Uint8Array): boolean {
  const head = new TextDecoder('latin1').decode(bytes).replaceAll('\0', '');
  return head.includes(BPMN) || (head.includes('<') && head.includes('definitions') && head.includes('omg.org/spec/BPMN'));
}
