/** Puts the parts of the page together. */

import './style/theme.css';
import './style/page.css';
import './style/qos.css';

import { namedFiles } from './files/named';
import { askText } from './layout/dialog';
import { startQos } from './qos';
import { moddleExtensions, untilLoaded } from './service/catalogue';
import { connect } from './service/transport';
import { createShell } from './shell';

async function start(): Promise<void> {
  const root = document.getElementById('app');
  if (root === null) {
    throw new Error('the page has no element #app');
  }
  const services = connect(location.origin, () => askText('Token', 'The service asks for a token', '', true));
  const named = await namedFiles();
  const catalogue = await untilLoaded(services, (reason) => {
    root.textContent = `Waiting for the service: ${reason}`;
  });
  root.textContent = '';
  const { prefix, namespace } = catalogue.form;
  const shell = createShell(root, { extensions: moddleExtensions(catalogue), binding: { prefix, namespace }, named });
  startQos(shell.workspace, services, catalogue);
  await shell.start();
}

void start();
