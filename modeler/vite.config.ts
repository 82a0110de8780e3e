import { defineConfig } from 'vite';

import { thirdParty } from './third_party';

export default defineConfig({
  base: './',
  plugins: [thirdParty()],
  build: {
    outDir: '../cqos_core/service/page',
    emptyOutDir: true,
    assetsInlineLimit: 0, // the content security policy allows no data: scripts and fonts
    chunkSizeWarningLimit: 2000,
    target: 'es2022',
  },
});
