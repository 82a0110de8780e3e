/** The part of bpmn-moddle that tests use: the package does not export its types. */
declare module 'bpmn-moddle' {
  export class BpmnModdle {
    constructor(extensions: Readonly<Record<string, object>>);
    fromXML(xml: string): Promise<{ rootElement: object }>;
    toXML(element: object): Promise<{ xml: string }>;
  }
}
