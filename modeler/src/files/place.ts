/** Where a document is read from and saved to. */

/** What a place held when it was read; a save states which of them it replaces. */
export interface Content {
  readonly bytes: Uint8Array<ArrayBuffer>;
  /** Of this place: changes with the bytes. */
  readonly tag: string;
}

/** Another program wrote, or removed, the file since it was read. */
export class ChangedOnDisk extends Error {}

export interface Place {
  readonly name: string;
  /** Tells places apart, also after the page was loaded again. */
  readonly id: string;
  /** The content, or null where there is no file yet. With a tag: null too where it is still that one. */
  read(unless?: string): Promise<Content | null>;
  /**
   * Replace the content of a tag, or of no file; return the tag of the new content.
   *
   * @throws ChangedOnDisk where the file has other content now.
   */
  write(bytes: Uint8Array<ArrayBuffer>, replaces: string | null): Promise<string>;
}

/** A file that the browser lets this page read and write. */
export function handlePlace(handle: FileSystemFileHandle, id: string): Place {
  const place: Place = {
    name: handle.name,
    id,
    async read(unless) {
      const file = await handle.getFile();
      const tag = `${file.lastModified} ${file.size}`;
      return tag === unless ? null : { bytes: new Uint8Array(await file.arrayBuffer()), tag };
    },
    async write(bytes, replaces) {
      if (replaces !== null && (await place.read(replaces)) !== null) {
        throw new ChangedOnDisk(`${handle.name} changed on disk since it was opened`);
      }
      const stream = await handle.createWritable();
      await stream.write(bytes);
      await stream.close();
      const file = await handle.getFile();
      return `${file.lastModified} ${file.size}`;
    },
  };
  return place;
}
