/** Puts the parts of the page together. */

import './style/theme.css';
import './style/page.css';

import { namedFiles } from './files/named';
import { createShell } from './shell';

async function start(): Promise<void> {
  const root = document.getElementById('app');
  if (root === null) {
    throw new Error('the page has no element #app');
  }
  const shell = createShell(root, { extensions: {}, binding: null, named: await namedFiles() });
  await shell.start();
}

void start();
