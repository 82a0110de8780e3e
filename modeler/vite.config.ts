import { defineConfig, type Plugin } from 'vite';

import { thirdParty } from './third_party';

/** Leave out the forms of the icon font that only browsers before 2018 read: 250 kB. */
function oneFont(): Plugin {
  const kept = /url\([^)]*\) format\('woff2'\)/;
  return {
    name: 'one-font',
    enforce: 'pre',
    transform: (code, id) =>
      id.includes('bpmn-font/css/bpmn.css') ? code.replace(/(?:\s*src:[^;]*;)+/, (all) => `src: ${kept.exec(all)?.[0] ?? ''};`) : null,
  };
}

export default defineConfig({
  base: './',
  plugins: [oneFont(), thirdParty()],
  build: {
    outDir: '../cqos_core/service/page',
    emptyOutDir: true,
    assetsInlineLimit: 0, // the content security policy allows no data: scripts and fonts
    chunkSizeWarningLimit: 2000,
    target: 'es2022',
  },
});
