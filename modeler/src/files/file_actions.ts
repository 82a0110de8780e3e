/** The commands on files: new, open, save, drop, recent. Drafts and questions keep work from being lost. */

import { ask } from '../layout/dialog';
import type { Companion, Notice, Regions } from '../workspace';
import { type Diagram, type Imported, NOWHERE, type Source } from './diagram';
import { isEqual } from './encoding';
import { chooseFiles, chooseTarget, type Chosen, download, droppedFiles, fromHandle } from './picker';
import { ChangedOnDisk, handlePlace, type Place } from './place';
import { isAllowed, type Recent, recentFiles, remember } from './recent';
import { undrawnWords } from './pools';
import { createRecovery, type DraftStore, type Recovery, ServiceAway, showAlive, type Unsaved } from './recovery';

const BPMN = 'http://www.omg.org/spec/BPMN/20100524/MODEL';
const KEEP_AFTER = 800;
const LOOK_EVERY = 2000;

/** What the commands on files work on. */
export interface FileContext {
  readonly diagram: Diagram;
  readonly regions: Regions;
  readonly named: readonly Place[];
  /** Keeps drafts for the next run of the modeler. */
  readonly drafts: DraftStore | null;
  addCompanion(companion: Companion): void;
  /** The name or the state of the diagram changed. */
  shown(): void;
}

export class FileActions {
  private readonly recovery: Recovery;
  private keeping: ReturnType<typeof setTimeout> | undefined;
  private isLooking = false;
  private kept = -1;
  /** Whether the service missed the last change of what is kept. */
  private isMissed = false;

  constructor(private readonly desktop: FileContext) {
    this.recovery = createRecovery(desktop.drafts, (why) => this.keptOutside(why));
  }

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

  /** Whether the changes are kept as they are now. */
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

  private failed(what: string, error: unknown, actions: Notice['actions'] = []): void {
    this.desktop.regions.notice('failed', { kind: 'error', closable: true, text: `${what}: ${wordsOf(error)}`, actions });
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
    const bytes = await this.toWrite(source.name, 'copy');
    if (bytes !== null) {
      await this.into(source.place, source.handle, source.tag, bytes);
    }
  }

  private async into(place: Place, handle: FileSystemFileHandle | null, replaces: string | null, bytes: Uint8Array<ArrayBuffer>): Promise<void> {
    this.desktop.regions.notice('failed', null);
    try {
      const tag = await place.write(bytes, replaces);
      await this.desktop.diagram.saved({ name: place.name, bytes, place, handle, tag });
    } catch (error) {
      if (error instanceof ChangedOnDisk) {
        this.onDisk(place);
      } else {
        this.notSaved(place.name, error);
      }
      return;
    }
    await this.afterSave(place.name, handle, bytes);
  }

  /** The bytes to save; null where they would write a whole file anew, and the person says no. */
  private async toWrite(name: string, otherwise: 'copy' | null): Promise<Uint8Array<ArrayBuffer> | null> {
    const { bytes, rewrites } = await this.desktop.diagram.toSave();
    if (rewrites === null) {
      return bytes;
    }
    const text = `The page cannot change just a part of ${name}: ${rewrites}.`;
    const answers = [
      ...(otherwise === 'copy' ? ([{ id: 'copy', label: 'Save a copy…' }] as const) : []),
      { id: 'rewrite', label: 'Rewrite the file' },
      { id: 'cancel', label: 'Cancel' },
    ] as const;
    const answer = await ask(`Rewrite all of ${name}?`, text, answers);
    if (answer === 'copy') {
      await this.copy();
    }
    return answer === 'rewrite' ? bytes : null;
  }

  /** Say why a save failed; the changes are still here, and can go elsewhere. */
  private notSaved(name: string, error: unknown): void {
    this.failed(`${name} was not saved`, error, [
      { label: 'Save again', run: () => void this.save() },
      { label: 'Save a copy…', run: () => void this.copy() },
    ]);
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
    const bytes = target === null ? null : await this.toWrite(name, null);
    if (target === null || bytes === null) {
      return;
    }
    if (target !== 'download') {
      await this.into(handlePlace(target, `handle ${target.name} ${Date.now()}`), target, null, bytes);
    } else {
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
    const name = this.desktop.diagram.source.name.replace(/(\.[^.]*)?$/, '-copy$1');
    const target = await chooseTarget(name);
    const { bytes } = await this.desktop.diagram.toSave();
    if (target === 'download') {
      download(name, bytes, 'application/xml');
      this.desktop.regions.announce(`Downloaded ${name}`, 'ok');
    } else if (target !== null) {
      await this.into(handlePlace(target, `handle ${target.name} ${Date.now()}`), target, null, bytes);
    }
  }

  /** Check whether another program wrote the file. */
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

  /** Say why the next run of the modeler would not have the draft. That the service is away stands in a notice already. */
  private keptOutside(why: unknown): void {
    this.isMissed = why instanceof ServiceAway;
    const text = `\`cqos modeler\` keeps no draft for its next run: ${wordsOf(why)}. This browser keeps it.`;
    const isSaid = why !== null && !this.isMissed;
    this.desktop.regions.notice('drafts', isSaid ? { kind: 'warning', closable: true, text } : null);
  }

  /** Take note of a command: the changes are kept a moment later. */
  edited(): void {
    this.desktop.shown();
    clearTimeout(this.keeping);
    this.keeping = setTimeout(() => void this.keep(), KEEP_AFTER);
  }

  private async keep(): Promise<void> {
    clearTimeout(this.keeping);
    if (!this.desktop.diagram.isEdited) {
      await this.recovery.forget(this.recovery.tab);
      return;
    }
    const { source, revision } = this.desktop.diagram;
    const { name, bytes, place, handle, tag } = source;
    const text = await this.desktop.diagram.draft();
    if (!this.desktop.diagram.isEdited || this.desktop.diagram.source !== source) {
      return; // it was saved, or gave way, meanwhile
    }
    const time = Date.now();
    await this.recovery.keep({ tab: this.recovery.tab, name, text, original: bytes, place: place?.id ?? null, handle, tag, time });
    this.kept = revision;
    this.desktop.shown();
  }

  private async forgetUnsaved(): Promise<void> {
    clearTimeout(this.keeping);
    this.desktop.regions.notice('recovered', null);
    await this.recovery.forget(this.recovery.tab);
  }

  private async recover(unsaved: Unsaved): Promise<boolean> {
    const named = this.desktop.named.find(({ id }) => id === unsaved.place) ?? null;
    const place = named ?? (unsaved.handle === null ? null : handlePlace(unsaved.handle, unsaved.place ?? ''));
    const { name, original, handle, tag, text } = unsaved;
    if (!(await this.show({ name, bytes: original, place, handle, tag, unsaved: text }))) {
      return false;
    }
    this.desktop.regions.announce(`Recovered ${name}`, 'ok');
    await this.keep();
    if (unsaved.tab !== this.recovery.tab) {
      await this.recovery.forget(unsaved.tab);
    }
    const discard = { label: 'Discard them', run: () => void this.discardRecovered() };
    const words = `Unsaved changes of ${name} were recovered (${timeOf(unsaved)}).`;
    this.desktop.regions.notice('recovered', { kind: 'info', closable: true, text: words, actions: [discard] });
    return true;
  }

  private offer(unsaved: Unsaved): void {
    const name = `recover ${unsaved.tab}`;
    const done = (): void => this.desktop.regions.notice(name, null);
    this.desktop.regions.notice(name, {
      kind: 'info',
      text: `Unsaved changes of ${unsaved.name} were kept (${timeOf(unsaved)}).`,
      actions: [
        { label: 'Recover', run: () => void this.mayLeave().then((may) => (may ? this.recover(unsaved).then((isShown) => (isShown ? done() : undefined)) : undefined)) },
        { label: 'Discard', run: () => void this.recovery.forget(unsaved.tab).then(done) },
      ],
    });
  }

  async start(): Promise<void> {
    const left = await this.leftBehind();
    showAlive(this.recovery.tab);
    // A draft of a file that the modeler was started with is what the person wants to see.
    const own = left.own ?? left.others.find(({ place }) => this.desktop.named.some(({ id }) => id === place)) ?? null;
    const isRecovered = own !== null && (await this.recover(own));
    left.others.filter((each) => each !== own).forEach((each) => this.offer(each));
    const opened = await Promise.all(this.desktop.named.map(async (place) => ({ place, content: await place.read() })));
    const first = opened.find(({ content }) => content === null || isDiagram(content.bytes));
    const isTried = !isRecovered && first !== undefined;
    const isShown = isTried && (await this.show(fromPlace(first.place, first.content)));
    if (!isRecovered && !isShown) {
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

  private async leftBehind(): Promise<Awaited<ReturnType<Recovery['leftBehind']>>> {
    try {
      return await this.recovery.leftBehind();
    } catch (error) {
      this.failed('This browser keeps no drafts', error); // as in a private window of some browsers
      return { own: null, others: [] };
    }
  }

  private async discardRecovered(): Promise<void> {
    const { place } = this.desktop.diagram.source;
    await this.forgetUnsaved();
    await this.show(place === null ? NOWHERE : fromPlace(place, await place.read(), this.desktop.diagram.source.handle));
  }

  private listen(): void {
    setInterval(() => void this.look().then(() => (this.isMissed ? this.keep() : undefined)), LOOK_EVERY);
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

function wordsOf(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}

function timeOf({ time }: Unsaved): string {
  return new Date(time).toLocaleString();
}

/** Whether a file is a BPMN diagram, and not a document of another kind. */
function isDiagram(bytes: Uint8Array): boolean {
  const head = new TextDecoder('latin1').decode(bytes).replaceAll('\0', '');
  return head.includes(BPMN) || (head.includes('<') && head.includes('definitions') && head.includes('omg.org/spec/BPMN'));
}
