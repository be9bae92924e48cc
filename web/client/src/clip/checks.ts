// Checked access to the fields of a clip header, which is JSON from the server.

import { ClipError } from "./error";

/** Reads fields of a clip header with type checks. Error messages contain the path of the field. */
export class Fields {
  private constructor(
    private readonly value: Readonly<Record<string, unknown>>,
    private readonly path: string,
  ) {}

  static of(value: unknown, path: string): Fields {
    if (typeof value !== "object" || value === null || Array.isArray(value)) {
      throw new ClipError(`${path} must be an object`);
    }
    return new Fields(value as Record<string, unknown>, path);
  }

  has(name: string): boolean {
    return this.value[name] !== undefined && this.value[name] !== null;
  }

  text(name: string): string {
    const value = this.value[name];
    if (typeof value !== "string") throw this.typeError(name, "text");
    return value;
  }

  number(name: string): number {
    const value = this.value[name];
    if (typeof value !== "number" || !Number.isFinite(value)) throw this.typeError(name, "a number");
    return value;
  }

  /** A whole number from `min` to `max`. */
  integer(name: string, min: number, max: number): number {
    const value = this.number(name);
    if (!Number.isInteger(value) || value < min || value > max) {
      throw this.typeError(name, `a whole number from ${min} to ${max}`);
    }
    return value;
  }

  boolean(name: string): boolean {
    const value = this.value[name];
    if (typeof value !== "boolean") throw this.typeError(name, "true or false");
    return value;
  }

  /** The entries of a list; empty if the field is missing. */
  list(name: string): { path: string; value: unknown }[] {
    if (!this.has(name)) return [];
    const value = this.value[name];
    if (!Array.isArray(value)) throw this.typeError(name, "a list");
    return value.map((entry: unknown, i) => ({ path: `${this.path}.${name}[${i}]`, value: entry }));
  }

  /** The entries of a list of objects. */
  objects(name: string): Fields[] {
    return this.list(name).map((entry) => Fields.of(entry.value, entry.path));
  }

  /** A field that is an object. */
  object(name: string): Fields {
    return Fields.of(this.value[name], `${this.path}.${name}`);
  }

  /** The error for a field with another type or value. */
  typeError(name: string, expected: string): ClipError {
    const actual = JSON.stringify(this.value[name]) as string | undefined;
    return new ClipError(
      `${this.path}.${name} must be ${expected}, but is ${actual === undefined ? "missing" : actual.slice(0, 40)}`,
    );
  }
}
