import { defineConfig } from 'vitest/config';

// One thread for all files, and one copy of what they import: no file changes it. Apart, they take twice as much of the processor.
export default defineConfig({ test: { pool: 'threads', isolate: false, fileParallelism: false } });
