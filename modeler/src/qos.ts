/** Puts the QoS of a diagram onto the page: live check, panel, markers, problems, matrix, documents beside it. */

import { createCompanions } from './companions/companions';
import { diagramOf } from './drawing/diagram';
import { watchNewElements } from './drawing/new_elements';
import { dress } from './findings/exported_verdicts';
import { createMarkers } from './findings/markers';
import { createMatrix } from './findings/matrix';
import { createProblems } from './findings/problems';
import { viewOf, type View } from './findings/view';
import { counted } from './findings/finding_text';
import { Severity, Verdict, type Report } from './gen/cqos/v1/report_pb';
import type { Page } from './page';
import { createPanel } from './panel/panel';
import type { Catalogue } from './service/catalogue';
import { sent, startLive, TIMEOUT, type LiveState, type Text } from './service/live_check';
import type { Services } from './service/transport';
import type { StatusKind, Workspace } from './workspace';

/** Start everything about QoS. The modeler of the workspace knows the moddle descriptor of the catalogue. */
export function startQos(workspace: Workspace, services: Services, catalogue: Catalogue): Page {
  const diagram = diagramOf(workspace.modeler);
  const live = startLive(services, () => documentsOf(workspace));
  let view: View | undefined;
  const page: Page = {
    workspace,
    diagram,
    catalogue,
    live,
    view: () => view,
    async suggest() {
      const documents = (await documentsOf(workspace)).map(sent);
      return (await services.checks.suggest({ documents: { documents } }, { timeoutMs: TIMEOUT })).plan;
    },
    reveal(element, policy) {
      diagram.reveal(element);
      if (policy !== undefined) {
        panel.focusPolicy(policy);
      }
    },
  };
  const panel = createPanel(page);
  const markers = createMarkers(page);
  const problems = createProblems(page);
  const matrix = createMatrix(page);
  const beside = createCompanions(page);

  function show({ phase, checked }: LiveState): void {
    if (phase === 'current' && checked) {
      view = viewOf(checked, workspace.document().name, fresh());
      markers.show(view);
      problems.show(view);
      matrix.show(view);
      beside.show(view);
      panel.update();
      showVerdict(workspace, view);
    }
  }
  // What was too early to report is not so once a person turns to something else.
  const fresh = watchNewElements(diagram, () => show(live.state));

  const enterToken = (): void => {
    services.gate.open();
    live.changed();
  };
  live.onState((state) => {
    markers.stale(state.phase === 'away' || state.phase === 'refused');
    showPhase(workspace, state, enterToken);
    if (state.phase === 'refused' && !state.needsToken) {
      problems.refused(state);
      beside.show(view);
    }
    show(state);
  });
  // Findings that came before their pack have names from files: they get their labels.
  catalogue.onLoaded(() => {
    if (view) {
      problems.show(view);
      matrix.show(view);
    }
  });
  workspace.onChanged((cause) => {
    panel.update();
    live.changed();
    if (cause === 'import') {
      setTimeout(() => showChecking(workspace, live.state), SOON);
    }
  });
  workspace.onCompanions(() => {
    beside.show(view);
    live.changed();
  });
  workspace.onExport((svg) => {
    if (view) {
      dress(svg, diagram, view);
    }
  });
  beside.show(view);
  addEventListener('pagehide', ({ persisted }) => {
    // A page that the browser keeps goes on with its session when it comes back.
    if (!persisted) {
      live.stop();
    }
  });
  return page;
}

async function documentsOf(workspace: Workspace): Promise<Text[]> {
  const diagram = workspace.document();
  const content = await diagram.semanticXml();
  const others = workspace.companions().map(({ name, bytes }) => ({ name, content: bytes }));
  return [{ name: diagram.name, content }, ...others];
}

const AWAY = 'service';
const SOON = 400;

/** Say that the first check of a diagram is still under way. */
function showChecking({ regions, document }: Workspace, { phase }: LiveState): void {
  if (phase === 'checking') {
    regions.status(`Checking ${document().name}…`, 'busy');
  }
}

function showPhase(workspace: Workspace, { phase, message, problems, needsToken }: LiveState, enterToken: () => void): void {
  const { regions } = workspace;
  if (phase === 'away') {
    regions.notice(AWAY, {
      kind: 'warning',
      text: `${message === '' ? 'The service does not answer.' : `The service says: ${message}.`} You can go on drawing; verdicts are grey until it is back.`,
    });
    regions.status('Not checked: the service does not answer', 'warning');
  } else if (needsToken) {
    const text = 'Nothing is checked: the service answers only callers with a token. You can go on drawing.';
    regions.notice(AWAY, { kind: 'warning', text, actions: [{ label: 'Enter the token', run: enterToken }] });
    regions.status('Not checked: the service needs a token', 'warning');
  } else if (phase === 'refused') {
    const names = [...new Set(problems.map((each) => each.place?.source ?? ''))].filter((name) => name !== '');
    const text = names.length > 0 ? `Nothing is checked: the service cannot read ${names.join(', ')}.` : `Nothing is checked: ${message}`;
    regions.notice(AWAY, {
      kind: 'error',
      text,
      actions: names.length > 0 ? [{ label: 'Why', run: () => regions.show('problems') }] : [],
    });
    regions.status(text, 'error');
  } else if (phase === 'current') {
    regions.notice(AWAY, null);
  }
}

/** Words for the whole, and how many of the pairs they are about. */
function verdictWords(report: Report): readonly [words: string, kind: StatusKind] {
  const { pairs = 0n, incompatible = 0n, unknown = 0n } = report.counts ?? {};
  const all = `${pairs} ${pairs === 1n ? 'pair' : 'pairs'}`;
  if (pairs === 0n) {
    return ['No pairs yet', 'info'];
  }
  if (report.verdict === Verdict.COMPATIBLE) {
    return report.coverage?.unread.length
      ? [`Compatible as far as read: ${pairs} of ${all}`, 'info']
      : [`Compatible: ${pairs} of ${all}`, 'ok'];
  }
  return report.verdict === Verdict.INCOMPATIBLE
    ? [`Incompatible: ${incompatible} of ${all}`, 'error']
    : [`Unknown: ${unknown} of ${all}`, 'warning'];
}

function showVerdict(workspace: Workspace, view: View): void {
  const open = view.findings.filter((each) => each.accepted === undefined);
  const count = (severity: Severity): number => open.filter((each) => each.severity === severity).length;
  const [errors, warnings] = [count(Severity.ERROR), count(Severity.WARNING)];
  const [verdict, kind] = verdictWords(view.checked.report);
  const alone = [...view.elements.values()].filter((each) => each.state === 'unmatched').length;
  const found = [
    errors > 0 ? counted(errors, Severity.ERROR) : '',
    warnings > 0 ? counted(warnings, Severity.WARNING) : '',
    alone > 0 ? `${alone} ${alone === 1 ? 'event' : 'events'} without a partner` : '',
  ].filter((each) => each !== '');
  workspace.regions.status([verdict, ...found].join(', '), errors > 0 ? 'error' : kind);
  workspace.regions.badge('problems', errors + warnings === 0 ? null : errors + warnings);
}
