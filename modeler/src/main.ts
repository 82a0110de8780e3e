/** Puts the parts of the page together. */

import './style/page.css';

import { createShell } from './shell';

async function start(): Promise<void> {
  const root = document.getElementById('app');
  if (root === null) {
    throw new Error('the page has no element #app');
  }
  await createShell(root, {});
}

void start();
