import { defineConfig } from 'vite';

export default defineConfig({
  base: './',
  build: {
    outDir: '../cqos_core/service/page',
    emptyOutDir: true,
    assetsInlineLimit: 0, // the content security policy allows no data: scripts and fonts
    chunkSizeWarningLimit: 2000,
    target: 'es2022',
  },
});
