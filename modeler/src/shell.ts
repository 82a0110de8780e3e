/** The shell: frame, diagram and files of the page, as the workspace that its other parts use. */

import type Canvas from 'diagram-js/lib/core/Canvas';
import type CommandStack from 'diagram-js/lib/command/CommandStack';
import type Modeler from 'bpmn-js/lib/Modeler';

import { createCanvas, fit, fitWithNotices, type ModdleExtensions, semanticXml, svgText } from './canvas';
import { bindCanvasKeys, chooseKind } from './canvas_keys';
import { FileActions } from './files/file_actions';
import { type Binding, createDiagram, type Diagram } from './files/diagram';
import { download } from './files/picker';
import type { Run } from './files/run_files';
import { bindKeys, type Command } from './layout/commands';
import { createFrame, type Frame } from './layout/frame';
import { createHeader } from './layout/header';
import { showHelp } from './layout/help';
import type { Entry } from './layout/menu';
import { nextTheme, setTheme, theme } from './layout/theme';
import { listeners } from './listeners';
import type { Companion, DrawnDocument, Workspace } from './workspace';

/** What the page is made with. */
export interface Given {
  /** Descriptors of what C-QoS writes into diagrams, by prefix. */
  readonly extensions: ModdleExtensions;
  /** Prefix and namespace of that. */
  readonly binding: Binding | null;
  /** The run of `cqos modeler`; null where a team's service serves the page. */
  readonly run: Run | null;
}

/** The shell. Nothing is open before `start`, so that the other parts hear of the first import too. */
export interface Shell {
  readonly workspace: Workspace;
  start(): Promise<void>;
}

/** Make the page in an element. */
export function createShell(root: HTMLElement, given: Given): Shell {
  const frame = createFrame(root);
  const modeler = createCanvas(frame.canvas, given.extensions);
  const changed = listeners<[cause: 'import' | 'edit']>();
  const besideChanged = listeners<[]>();
  const exported = listeners<[svg: SVGSVGElement]>();
  const companions = new Map<string, Companion>();
  const diagram = createDiagram(modeler, given.binding, (cause) => {
    if (cause === 'import') {
      fitWithNotices(modeler);
    }
    changed.call(cause);
    fileActions.edited();
  });
  const addCompanion = (companion: Companion): void => {
    companions.set(companion.name, companion);
    besideChanged.call();
  };
  const fileActions = new FileActions({ diagram, regions: frame.regions, named: given.run?.files ?? [], drafts: given.run?.drafts ?? null, addCompanion, shown: () => shown() });
  const shown = dress(frame, modeler, diagram, fileActions, exported.call);
  const removeCompanion = (name: string): void => {
    companions.delete(name);
    besideChanged.call();
  };
  const workspace: Workspace = {
    modeler,
    regions: frame.regions,
    document: () => drawn(modeler, diagram),
    onChanged: changed.add,
    companions: () => [...companions.values()],
    addCompanion,
    removeCompanion,
    onCompanions: besideChanged.add,
    async swap(name) {
      const companion = companions.get(name);
      const left = companion === undefined ? null : await fileActions.openCompanion(companion);
      if (left !== null) {
        removeCompanion(name);
        left.forEach(addCompanion);
      }
    },
    onExport: exported.add,
  };
  return { workspace, start: () => fileActions.start() };
}

function drawn(modeler: Modeler, diagram: Diagram): DrawnDocument {
  return {
    name: diagram.source.name,
    revision: diagram.revision,
    xml: () => diagram.text(),
    semanticXml: () => semanticXml(modeler),
  };
}

/** Header, keys and theme; the result shows the state of the diagram in the header. */
function dress(frame: Frame, modeler: Modeler, diagram: Diagram, fileActions: FileActions, dressExport: (svg: SVGSVGElement) => void): () => void {
  setTheme(theme());
  bindCanvasKeys(modeler);
  const commands: Command[] = [
    ...fileCommands(modeler, diagram, fileActions, dressExport, (name) => frame.regions.announce(`Exported ${name}`, 'ok')),
    ...viewCommands(modeler),
    { id: 'add', label: 'Add an element', keys: 'Mod+Enter', run: () => chooseKind(modeler) },
    { id: 'panel', label: 'Show or hide the properties', run: () => frame.toggle('panel') },
    { id: 'bottom', label: 'Show or hide problems and matrix', run: () => frame.toggle('bottom') },
    { id: 'theme', label: 'Light, dark or system theme', run: () => frame.regions.announce(`Theme: ${turnTheme()}`, 'info') },
    { id: 'help', label: 'Keyboard help', keys: '?', run: () => showHelp(commands) },
  ];
  bindKeys(commands);
  const showState = createHeader(frame.header, commands, () => recentEntries(fileActions));
  const shown = (): void => {
    const stack = modeler.get<CommandStack>('commandStack');
    showState({
      name: diagram.source.name,
      isEdited: diagram.isEdited,
      isKept: fileActions.isKept,
      zoom: modeler.get<Canvas>('canvas').zoom(),
      canUndo: stack.canUndo(),
      canRedo: stack.canRedo(),
    });
  };
  modeler.on('canvas.viewbox.changed', shown);
  return shown;
}

function fileCommands(modeler: Modeler, diagram: Diagram, fileActions: FileActions, dressExport: (svg: SVGSVGElement) => void, exported: (name: string) => void): Command[] {
  const exportSvg = (): void => {
    const name = diagram.source.name.replace(/(\.bpmn)?(\.[^.]*)?$/, '.svg');
    download(name, svgText(modeler, dressExport), 'image/svg+xml');
    exported(name);
  };
  return [
    { id: 'new', label: 'New diagram', run: () => void fileActions.newDiagram() },
    { id: 'open', label: 'Open a file', keys: 'Mod+O', run: () => void fileActions.open() },
    { id: 'save', label: 'Save', keys: 'Mod+S', run: () => void fileActions.save() },
    { id: 'save-as', label: 'Save as…', keys: 'Mod+Shift+S', run: () => void fileActions.saveAs() },
    { id: 'export-svg', label: 'Export as SVG', run: exportSvg },
  ];
}

function viewCommands(modeler: Modeler): Command[] {
  const stack = (): CommandStack => modeler.get<CommandStack>('commandStack');
  const canvas = (): Canvas => modeler.get<Canvas>('canvas');
  const zoomBy = (factor: number): void => {
    canvas().zoom(Math.min(4, Math.max(0.2, canvas().zoom() * factor)));
  };
  return [
    { id: 'undo', label: 'Undo', keys: 'Mod+Z', run: () => stack().canUndo() && stack().undo() },
    { id: 'redo', label: 'Redo', keys: 'Mod+Y', run: () => stack().canRedo() && stack().redo() },
    { id: 'redo-too', label: 'Redo', keys: 'Mod+Shift+Z', run: () => stack().canRedo() && stack().redo() },
    { id: 'zoom-in', label: 'Zoom in', keys: 'Mod+Plus', run: () => zoomBy(1.25) },
    { id: 'zoom-out', label: 'Zoom out', keys: 'Mod+-', run: () => zoomBy(0.8) },
    { id: 'zoom-reset', label: 'Zoom to 100 %', keys: 'Mod+0', run: () => canvas().zoom(1) },
    { id: 'zoom-fit', label: 'Fit the diagram into view', keys: 'Mod+9', run: () => fit(modeler) },
  ];
}

function turnTheme(): string {
  setTheme(nextTheme());
  return theme();
}

/** What the menu beside "Open" offers. */
async function recentEntries(fileActions: FileActions): Promise<Entry[]> {
  const recent = await fileActions.recent();
  const named = fileActions.named.map((place) => ({ label: place.name, run: () => void fileActions.openNamed(place) }));
  const others = recent.map((each) => ({ label: each.name, run: () => void fileActions.openRecent(each) }));
  return [
    ...(named.length > 0 ? [{ label: 'Files of this run' }, ...named] : []),
    { label: others.length > 0 ? 'Recent files' : 'No recent files' },
    ...others,
  ];
}
