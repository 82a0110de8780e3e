/** Writes the licences of all packages whose code is in the bundle beside it. */

import { existsSync, readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';

import type { Plugin } from 'vite';

const PACKAGE = /^(.*\/node_modules\/((?:@[^/]+\/)?[^/]+))\//;
const HEAD = `The page of the C-QoS modeler contains code of these packages, under their own licences.
bpmn-js is drawn with the bpmn.io watermark, which its licence demands.
`;

export function thirdParty(): Plugin {
  return {
    name: 'third-party',
    generateBundle(_options, bundle) {
      const files = Object.values(bundle).flatMap((each) => (each.type === 'chunk' ? Object.keys(each.modules) : []));
      const folders = new Set(files.map((file) => PACKAGE.exec(file.replace('\0', ''))?.[1]).filter((each) => each !== undefined));
      const texts = [...folders].map(described).sort();
      this.emitFile({ type: 'asset', fileName: 'THIRD-PARTY.txt', source: [HEAD, ...texts].join(`\n${'-'.repeat(80)}\n\n`) });
    },
  };
}

function described(folder: string): string {
  const about = JSON.parse(readFileSync(join(folder, 'package.json'), 'utf-8')) as Record<string, unknown>;
  const title = `${String(about['name'])} ${String(about['version'])}, ${String(about['license'])}`;
  const file = readdirSync(folder).find((name) => /^licen[cs]e(\.|$)/i.test(name));
  if (file === undefined && !existsSync(join(folder, 'README.md'))) {
    throw new Error(`${title}: no licence text`);
  }
  return `${title}\n${file === undefined ? '' : `\n${readFileSync(join(folder, file), 'utf-8').trim()}\n`}`;
}
