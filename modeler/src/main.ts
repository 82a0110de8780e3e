/** Puts the parts of the page together. */

import './style/theme.css';
import './style/page.css';
import './style/qos.css';

import { ConnectError } from '@connectrpc/connect';

import { thisRun, type Run } from './files/run_files';
import { askText } from './layout/dialog';
import { button, make } from './layout/dom';
import { startQos } from './qos';
import { moddleExtensions, untilLoaded, type Catalogue } from './service/catalogue';
import { failure } from './service/failures';
import { connect, type Services } from './service/transport';
import { createShell } from './shell';

/** The service keeps no tokens of people: the page keeps one until its tab is closed. */
function askToken(isRefused: boolean): Promise<string | null> {
  return askText({
    title: 'Token of the service',
    text: 'This service answers only callers with a token. Ask the team that runs it for one. The page keeps the token until you close this tab.',
    label: 'Token',
    isSecret: true,
    ...(isRefused ? { problem: 'The service refused this token.' } : {}),
  });
}

/** Say something in place of the page, which is not there yet. */
function say(root: HTMLElement, text: string, ...more: HTMLElement[]): void {
  root.replaceChildren(make('main', { class: 'start' }, make('h1', {}, 'C-QoS'), make('p', { role: 'status' }, text), ...more));
}

/** The run of `cqos modeler`; if it refuses the page, a person can try again, or open the right address. */
async function runFor(root: HTMLElement): Promise<Run | null> {
  for (;;) {
    try {
      return await thisRun();
    } catch (error) {
      const text = error instanceof Error ? error.message : String(error);
      await new Promise<void>((again) => say(root, text, button('Try again', again, { class: 'primary' })));
    }
  }
}

/** The catalogue; without one, the page says why, and a person can try again. */
async function catalogueFor(services: Services, root: HTMLElement): Promise<Catalogue> {
  for (;;) {
    say(root, 'Loading…');
    try {
      return await untilLoaded(services, (reason) => say(root, `Waiting for the service: ${reason}`));
    } catch (error) {
      const why = failure(error);
      const needsToken = why.kind === 'refused' && why.needsToken;
      const text = needsToken ? 'This service answers only callers with a token.' : `The service refused the page: ${ConnectError.from(error).rawMessage}`;
      await new Promise<void>((again) => say(root, text, button(needsToken ? 'Enter the token' : 'Try again', again, { class: 'primary' })));
      services.gate.open();
    }
  }
}

async function start(): Promise<void> {
  const root = document.getElementById('app');
  if (root === null) {
    throw new Error('the page has no element #app');
  }
  const services = connect(location.origin, askToken);
  const run = await runFor(root);
  const catalogue = await catalogueFor(services, root);
  root.textContent = '';
  const { prefix, namespace } = catalogue.form;
  const shell = createShell(root, { extensions: moddleExtensions(catalogue), binding: { prefix, namespace }, run });
  startQos(shell.workspace, services, catalogue);
  await shell.start();
}

void start();
